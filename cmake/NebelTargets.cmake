# How every target of the project is compiled, and the libraries and programs made of the rooms of src/.

set(nebel_warnings -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wstrict-prototypes
    -Wmissing-prototypes)
if(MINGW)
    # isfinite, isnan and their kin are macros there, with a conversion to each type in branches that are not taken.
    list(APPEND nebel_warnings -Wno-float-conversion)
endif()
if(NEBEL_WERROR)
    list(APPEND nebel_warnings -Werror)
endif()

# Results must be the same bits in every build: no fused multiply-add unless written, no errno from the maths library.
set(nebel_arithmetic -ffp-contract=off -fno-math-errno)

# For x86 in 32 bits gcc computes in the x87 unit, whose results are wider and hang on the thread's setting. Windows promises only 4
# bytes of alignment for the stack there.
if(CMAKE_SIZEOF_VOID_P EQUAL 4 AND CMAKE_SYSTEM_PROCESSOR MATCHES "^(i[3-6]86|x86|x86_64|AMD64|amd64)$")
    set(nebel_is_x86_32 ON)
    list(APPEND nebel_arithmetic -msse2 -mfpmath=sse)
    if(MINGW)
        list(APPEND nebel_arithmetic -mstackrealign)
    endif()
endif()

set(nebel_sanitizers "")
if(NEBEL_SANITIZE)
    # Without optimization tests take four times as long. Beyond -O1 gcc 12 fails in the march of SSE2 ("internal compiler error:
    # in gimple_expand_vec_cond_expr").
    set(nebel_sanitizers $<$<OR:$<CONFIG:Debug>,$<C_COMPILER_ID:GNU>>:-O1> -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
endif()
if(NEBEL_BUILD_FUZZ)
    if(NOT CMAKE_C_COMPILER_ID MATCHES "Clang")
        message(FATAL_ERROR "NEBEL_BUILD_FUZZ needs clang: configure with -DCMAKE_C_COMPILER=clang")
    endif()
    list(APPEND nebel_sanitizers -fsanitize=fuzzer-no-link)
endif()

# -O3 is CMake's choice for Release; -O2 is ours, also for the kernels, which are vectorized by hand.
string(REPLACE "-O3" "-O2" CMAKE_C_FLAGS_RELEASE "${CMAKE_C_FLAGS_RELEASE}")

function(nebel_set_options target)
    set_target_properties(${target} PROPERTIES
        C_STANDARD 11 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON
        C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
    # Fuzzers count branches of what they link. Tests and the libraries above that are faster without.
    set(sanitizers ${nebel_sanitizers})
    if(target MATCHES "^nebel_(test|cpu|gl|bench)")
        list(REMOVE_ITEM sanitizers -fsanitize=fuzzer-no-link)
    endif()
    target_compile_options(${target} PRIVATE ${nebel_warnings} ${nebel_arithmetic} ${sanitizers})
    target_link_options(${target} PRIVATE ${nebel_sanitizers})
endfunction()

# The sources of a room; a room may still be empty.
function(nebel_glob result)
    file(GLOB sources CONFIGURE_DEPENDS ${ARGN})
    set(${result} ${sources} PARENT_SCOPE)
endfunction()

# The sources of several rooms.
function(nebel_glob_rooms result)
    list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/src/ OUTPUT_VARIABLE patterns)
    list(TRANSFORM patterns APPEND /*.c)
    nebel_glob(sources ${patterns})
    set(${result} ${sources} PARENT_SCOPE)
endfunction()

# With CMAKE_UNITY_BUILD the sources of a room in a library are one unit. Formula texts have no guards and are read again for every
# arithmetic, so sources that read one, or a header that does, are compiled alone. So is base.c, which every library has: the linker
# takes one of them where it is a member of its own.
function(nebel_set_unity target)
    if(NOT nebel_unity_build)
        return()
    endif()
    set(alone "^ *# *include \"formulas/(prelude\\.h|[a-z_]+\\.inc)\"|^ *# *define NB_DOUBLE")
    nebel_glob(headers ${PROJECT_SOURCE_DIR}/src/*/*.h)
    foreach(header IN LISTS headers)
        file(STRINGS ${header} lines REGEX "${alone}" LIMIT_COUNT 1)
        get_filename_component(name ${header} NAME)
        if(lines AND NOT header MATCHES "/src/formulas/")
            string(REPLACE . "\\." name ${name})
            string(APPEND alone "|^ *# *include \"([a-z_]+/)?${name}\"")
        endif()
    endforeach()
    get_target_property(sources ${target} SOURCES)
    foreach(source IN LISTS sources)
        if(NOT source MATCHES "/src/([a-z_]+)/[a-z_0-9]+\\.c$")
            continue()
        endif()
        set(room ${CMAKE_MATCH_1})
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${room})
        file(STRINGS ${source} lines REGEX "${alone}" LIMIT_COUNT 1)
        if(lines OR source MATCHES "/base/base\\.c$")
            set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
            continue()
        endif()
        # CMake leaves out of units what has options of its own.
        get_source_file_property(options ${source} COMPILE_OPTIONS)
        if(options)
            set_property(SOURCE ${source} PROPERTY COMPILE_OPTIONS)
            set_source_files_properties(${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/Unity/unity_${room}_c.c
                PROPERTIES COMPILE_OPTIONS "${options}")
        endif()
    endforeach()
    # Some sources ask for more of the system's headers than C11; in a unit the first header decides for all.
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP
        UNITY_BUILD_CODE_BEFORE_INCLUDE "#ifndef _GNU_SOURCE\n#define _GNU_SOURCE\n#endif\n#undef _DEFAULT_SOURCE")
endfunction()

# Compiles objects once; makes the library <name> of them and of the kernel objects named after the sources.
function(nebel_add_library name sources extra_objects)
    add_library(${name}_objects OBJECT ${sources})
    nebel_set_options(${name}_objects)
    nebel_set_unity(${name}_objects)
    target_include_directories(${name}_objects PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)

    add_library(${name} $<TARGET_OBJECTS:${name}_objects> ${extra_objects})
    set_target_properties(${name} PROPERTIES
        LINKER_LANGUAGE C VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
        nebel_objects "$<TARGET_OBJECTS:${name}_objects>;${extra_objects}")
    target_include_directories(${name} INTERFACE
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    # PUBLIC where the library is static: whoever links it links with the sanitizers' run time, too.
    target_link_options(${name} PUBLIC $<BUILD_INTERFACE:${nebel_sanitizers}>)
    if(BUILD_SHARED_LIBS)
        target_compile_definitions(${name}_objects PRIVATE NEBEL_BUILDING_SHARED)
        target_link_options(${name} PRIVATE LINKER:--no-undefined)
    endif()
endfunction()

# The texts of src/shader as a C file; see NebelShaderText.cmake.
function(nebel_add_shader_text result)
    set(script ${PROJECT_SOURCE_DIR}/cmake/NebelShaderText.cmake)
    set(output ${PROJECT_BINARY_DIR}/shader_text.c)
    nebel_glob(parts ${PROJECT_SOURCE_DIR}/src/formulas/* ${PROJECT_SOURCE_DIR}/src/shader/*.glsl)
    add_custom_command(OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR} -DOUTPUT=${output} -P ${script}
        DEPENDS ${script} ${parts} ${PROJECT_SOURCE_DIR}/src/shader/texel_layout.h VERBATIM)
    set(${result} ${output} PARENT_SCOPE)
endfunction()

function(nebel_add_core)
    nebel_glob_rooms(sources base math medium fog light stream trace diffusion classic cells particles atmosphere planet clouds
        shader)
    # Only scenes need these; they bring them along, see nebel_add_layer.
    list(FILTER sources EXCLUDE REGEX "/(base/(arena|bytes)|math/affine)\\.c$")
    # Clouds are short loops over three axes and eight corners, which -O2 of gcc does not unroll.
    nebel_glob(clouds src/clouds/*.c)
    if(CMAKE_C_COMPILER_ID STREQUAL GNU)
        set_source_files_properties(${clouds} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O3>)
    endif()
    nebel_add_shader_text(text)
    list(APPEND sources ${text})
    nebel_add_kernels(kernel_objects definitions)
    list(REMOVE_ITEM sources ${nebel_kernel_files})
    nebel_add_library(nebel "${sources}" "${kernel_objects}")
    target_compile_definitions(nebel_objects PRIVATE ${definitions})
    target_link_libraries(nebel PRIVATE m)
    add_library(nebel::nebel ALIAS nebel)
endfunction()

# A library on top of the core, of the room <room> and those that follow it, with what nebel_find_<room>_dependencies has found. It
# sees the core through include/ only and brings its own copies of the helpers of base and math that it needs.
function(nebel_add_layer name room)
    nebel_glob_rooms(sources ${room} ${ARGN})
    list(APPEND sources ${PROJECT_SOURCE_DIR}/src/base/base.c)
    if(room STREQUAL scene)
        list(APPEND sources ${PROJECT_SOURCE_DIR}/src/base/arena.c ${PROJECT_SOURCE_DIR}/src/base/bytes.c
            ${PROJECT_SOURCE_DIR}/src/math/affine.c)
    endif()
    nebel_add_library(${name} "${sources}" "")
    target_link_libraries(${name}_objects PRIVATE ${nebel_${room}_dependencies})
    target_link_libraries(${name} PUBLIC nebel PRIVATE m ${nebel_${room}_dependencies})
    set_target_properties(${name} PROPERTIES EXPORT_NAME ${room})
    add_library(nebel::${room} ALIAS ${name})
endfunction()

# Warnings and sanitizers of files in C++.
function(nebel_set_cxx_options target)
    set(warnings ${nebel_warnings})
    list(REMOVE_ITEM warnings -Wstrict-prototypes -Wmissing-prototypes)
    set_target_properties(${target} PROPERTIES CXX_STANDARD_REQUIRED ON CXX_EXTENSIONS OFF)
    target_compile_options(${target} PRIVATE ${warnings} ${nebel_sanitizers})
endfunction()

# The one file of nebel_scene in C++; OpenVDB asks for C++17.
function(nebel_add_openvdb)
    file(STRINGS ${nebel_openvdb_include}/openvdb/version.h lines
        REGEX "^#define OPENVDB_LIBRARY_(MAJOR|MINOR|PATCH)_VERSION_NUMBER [0-9]+$")
    string(REGEX MATCHALL "[0-9]+" numbers "${lines}")
    list(JOIN numbers "." version)
    add_library(nebel_vdb_objects OBJECT ${PROJECT_SOURCE_DIR}/src/grid_file/openvdb_read.cpp)
    nebel_set_cxx_options(nebel_vdb_objects)
    set_target_properties(nebel_vdb_objects PROPERTIES CXX_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
    target_include_directories(nebel_vdb_objects PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_link_libraries(nebel_vdb_objects PRIVATE nebel_openvdb)
    target_compile_definitions(nebel_scene_objects PRIVATE NEBEL_HAVE_OPENVDB="${version}")
    target_sources(nebel_scene PRIVATE $<TARGET_OBJECTS:nebel_vdb_objects>)
    set_property(TARGET nebel_scene APPEND PROPERTY nebel_objects $<TARGET_OBJECTS:nebel_vdb_objects>)
endfunction()

# nebel-read-model, which reads models for nebel_scene in a process of its own; where the library looks for it depends on who
# links it.
function(nebel_add_model_reader)
    get_target_property(objects nebel_scene nebel_objects)
    add_library(nebel_model_parts STATIC EXCLUDE_FROM_ALL ${objects})
    set_target_properties(nebel_model_parts PROPERTIES LINKER_LANGUAGE C)
    nebel_glob(sources src/model_reader/*.c)
    list(FILTER sources EXCLUDE REGEX "/reader_path\\.c$")
    nebel_add_program(nebel_read_model "${sources}" nebel_model_parts ${nebel_model_dependencies} m)
    # Of an archive only what a program uses is linked; a unit brings its whole room.
    if(nebel_unity_build)
        target_link_libraries(nebel_read_model PRIVATE ${nebel_scene_dependencies})
    endif()
    target_include_directories(nebel_read_model PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
    set_target_properties(nebel_read_model PROPERTIES
        OUTPUT_NAME nebel-read-model RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
    if(TARGET nebel_meshopt)
        target_link_libraries(nebel_read_model PRIVATE nebel_meshopt)
        target_compile_definitions(nebel_read_model PRIVATE NEBEL_HAVE_MESHOPT=1)
    endif()
    nebel_name_model_reader(nebel_scene ${CMAKE_INSTALL_FULL_BINDIR}/nebel-read-model)
endfunction()

# Tells the library <target> which program reads models where its caller names none.
function(nebel_name_model_reader target path)
    add_library(${target}_reader OBJECT ${PROJECT_SOURCE_DIR}/src/model_reader/reader_path.c)
    nebel_set_options(${target}_reader)
    target_include_directories(${target}_reader PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(${target}_reader PRIVATE NEBEL_MODEL_READER="${path}")
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:${target}_reader>)
endfunction()

# <name>_internal: the library with every symbol visible, for tests and benchmarks that enter the rooms.
function(nebel_add_internal_libraries)
    foreach(name nebel nebel_scene nebel_cpu nebel_gl)
        if(NOT TARGET ${name})
            continue()
        endif()
        get_target_property(objects ${name} nebel_objects)
        add_library(${name}_internal STATIC EXCLUDE_FROM_ALL ${objects})
        set_target_properties(${name}_internal PROPERTIES LINKER_LANGUAGE C)
        target_include_directories(${name}_internal INTERFACE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
        target_link_options(${name}_internal INTERFACE ${nebel_sanitizers})
        target_link_libraries(${name}_internal INTERFACE m)
    endforeach()
    if(TARGET nebel_scene)
        nebel_name_model_reader(nebel_scene_internal ${PROJECT_BINARY_DIR}/nebel-read-model)
        add_dependencies(nebel_scene_internal nebel_read_model)
        target_link_libraries(nebel_scene_internal INTERFACE nebel_internal ${nebel_scene_dependencies})
    endif()
    if(TARGET nebel_cpu)
        target_link_libraries(nebel_cpu_internal INTERFACE nebel_scene_internal ${nebel_cpu_dependencies})
    endif()
    if(TARGET nebel_gl)
        target_link_libraries(nebel_gl_internal INTERFACE nebel_internal ${nebel_gl_dependencies})
    endif()
endfunction()

# A program of the project, linked with what is given.
function(nebel_add_program name sources)
    add_executable(${name} ${sources})
    nebel_set_options(${name})
    target_link_libraries(${name} PRIVATE ${ARGN})
endfunction()

# The program's sources but main.c, for itself, for tests and for fuzzers. Archive members that a program does not use, and
# the libraries that only they need, are not linked.
function(nebel_add_tool_parts)
    nebel_glob(sources tools/*.c)
    list(FILTER sources EXCLUDE REGEX "/main\\.c$")
    if(NOT sources)
        return()
    endif()
    if(NOT TARGET nebel_bench)
        list(FILTER sources EXCLUDE REGEX "/cmd_bench\\.c$")
    endif()
    if(NOT TARGET nebel_gl)
        list(FILTER sources EXCLUDE REGEX "/gl_[a-z_]+\\.c$")
    endif()
    find_package(Threads REQUIRED)
    add_library(nebel_tool_parts STATIC EXCLUDE_FROM_ALL ${sources})
    nebel_set_options(nebel_tool_parts)
    target_include_directories(nebel_tool_parts
        PUBLIC ${PROJECT_SOURCE_DIR}/tools PRIVATE ${PROJECT_SOURCE_DIR}/include)
    target_link_libraries(nebel_tool_parts PUBLIC Threads::Threads)
    nebel_find_mpi()
    if(NEBEL_MPI AND MPI_C_FOUND)
        target_link_libraries(nebel_tool_parts PRIVATE MPI::MPI_C)
        target_compile_definitions(nebel_tool_parts PRIVATE NEBEL_HAVE_MPI=1)
    endif()
    if(TARGET nebel_bench)
        target_link_libraries(nebel_tool_parts PUBLIC nebel_bench)
        target_compile_definitions(nebel_tool_parts PUBLIC NEBEL_HAVE_BENCH=1)
    endif()
    if(TARGET nebel_gl)
        target_link_libraries(nebel_tool_parts PUBLIC nebel_gl ${nebel_gl_dependencies})
        target_compile_definitions(nebel_tool_parts PUBLIC NEBEL_HAVE_GL=1)
    endif()
    if(nebel_viewer_found)
        target_compile_definitions(nebel_tool_parts PRIVATE NEBEL_HAVE_VIEWER=1)
    endif()
endfunction()

# The window of `nebel view`, with its controls in C++.
function(nebel_add_viewer)
    nebel_glob(sources tools/viewer/*.c)
    nebel_glob(panel_sources tools/viewer/*.cpp)
    add_library(nebel_panel OBJECT ${panel_sources})
    nebel_set_cxx_options(nebel_panel)
    set_target_properties(nebel_panel PROPERTIES CXX_STANDARD 11)
    target_include_directories(nebel_panel PRIVATE ${PROJECT_SOURCE_DIR}/include)
    target_link_libraries(nebel_panel PRIVATE ${nebel_viewer_dependencies})
    add_library(nebel_viewer OBJECT ${sources})
    nebel_set_options(nebel_viewer)
    target_include_directories(nebel_viewer PRIVATE ${PROJECT_SOURCE_DIR}/include)
    target_link_libraries(nebel_viewer PRIVATE ${nebel_viewer_dependencies} Threads::Threads)
    target_link_libraries(nebel_tool PRIVATE nebel_viewer nebel_panel ${nebel_viewer_dependencies})
endfunction()

function(nebel_add_tool)
    nebel_glob(sources tools/main.c)
    if(NOT sources)
        return()
    endif()
    nebel_add_program(nebel_tool ${sources} nebel_tool_parts nebel_cpu nebel_scene nebel m)
    if(nebel_viewer_found)
        nebel_add_viewer()
    endif()
    add_dependencies(nebel_tool nebel_read_model)
    set_target_properties(nebel_tool PROPERTIES OUTPUT_NAME nebel RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
endfunction()
