# The fog function as text, one C array per dialect. Run as a script:
#
#     cmake -DSOURCE=<the project> -DOUTPUT=<file.c> -P NebelShaderText.cmake     the arrays nb_shader_text_<dialect>
#     cmake -DSOURCE=<the project> -DDIALECT=<dialect> -DOUTPUT=<file> -P ...     one text as it is, to compile or to read
#
# Comments and empty lines are left out: drivers read the text anew at every start.

set(formulas ${SOURCE}/src/formulas)
set(shader ${SOURCE}/src/shader)
file(STRINGS ${formulas}/ORDER order REGEX "^[^#]")
list(TRANSFORM order PREPEND ${formulas}/)
set(march ${formulas}/prelude_shader.glsl ${order} ${shader}/texel_layout.h)

set(dialects glsl_330 glsl_300_es glsl_450 hlsl)
set(last ${shader}/view_rays.glsl ${shader}/grid.glsl ${shader}/medium.glsl ${shader}/environment.glsl ${shader}/sky_view.glsl ${shader}/sun_lattice.glsl
         ${shader}/medium_slots.glsl ${shader}/shadow_depth.glsl ${shader}/sun.glsl ${shader}/fog.glsl ${shader}/voxels.glsl ${shader}/point_light.glsl
         ${shader}/diffusion.glsl ${shader}/trace.glsl ${shader}/transparent.glsl)
set(files_glsl_330 ${formulas}/prelude_glsl.glsl ${march} ${shader}/bindings.glsl ${last})
set(files_glsl_300_es ${formulas}/prelude_300es.glsl ${files_glsl_330})
set(files_glsl_450 ${formulas}/prelude_glsl.glsl ${march} ${last})
set(files_hlsl ${formulas}/prelude_hlsl.hlsl ${march} ${last})

# Semicolons and brackets mean something to lists and to regular expressions, so the text is handled as one string.
function(read_text dialect result)
    set(text "")
    foreach(file IN LISTS files_${dialect})
        file(READ ${file} part)
        string(APPEND text "${part}")
    endforeach()
    string(REGEX REPLACE "/\\*([^*]|\\*+[^*/])*\\*+/" "" text "${text}")
    string(REGEX REPLACE " +\n" "\n" text "${text}")
    string(REGEX REPLACE "\n\n+" "\n" text "${text}")
    set(${result} "${text}" PARENT_SCOPE)
endfunction()

if(DEFINED DIALECT)
    read_text(${DIALECT} text)
    file(WRITE ${OUTPUT} "${text}")
    return()
endif()

set(code "/* Made by cmake/NebelShaderText.cmake. */\n#include \"shader/shader_source.h\"\n")
foreach(dialect IN LISTS dialects)
    read_text(${dialect} text)
    string(HEX "${text}" bytes)
    string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
    string(APPEND code "\nconst char nb_shader_text_${dialect}[] = {\n${bytes}\n0};\n")
endforeach()
file(WRITE ${OUTPUT} "${code}")
