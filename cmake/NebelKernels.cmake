# The kernel files, compiled once per instruction set. Each object has one global symbol, whose name ends in the level.

set(nebel_kernel_files ${PROJECT_SOURCE_DIR}/src/trace/trace_kernel.c ${PROJECT_SOURCE_DIR}/src/stream/segment_kernel.c
    ${PROJECT_SOURCE_DIR}/src/stream/pixel_kernel.c ${PROJECT_SOURCE_DIR}/src/stream/picture_kernel.c
    ${PROJECT_SOURCE_DIR}/src/stream/vertex_kernel.c
    ${PROJECT_SOURCE_DIR}/src/clouds/cloud_position_kernel.c ${PROJECT_SOURCE_DIR}/src/clouds/cloud_density_kernel.c
    ${PROJECT_SOURCE_DIR}/src/atmosphere/in_scattering_kernel.c ${PROJECT_SOURCE_DIR}/src/atmosphere/sky_view_kernel.c)

set(nebel_flags_scalar "")
set(nebel_flags_neon "")
set(nebel_flags_double "")
set(nebel_flags_quad "")
set(nebel_flags_sse2 -msse2)
set(nebel_flags_avx2 -mavx2 -mfma)
set(nebel_flags_avx512 -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma -mavx2)

if(nebel_is_x86_32 OR (CMAKE_SIZEOF_VOID_P EQUAL 8 AND CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$"))
    set(nebel_levels scalar sse2 avx2 avx512)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
    set(nebel_levels scalar neon)
else()
    set(nebel_levels scalar)
endif()

# gcc aligns the stack to 16 bytes on 64-bit Windows but moves wide vectors there as if it were to 32 or 64 (gcc bug 54412; Debian's
# gcc is mended). Assemblers since binutils 2.38 can make unaligned moves of these, as fast where the address is aligned.
if(MINGW AND NOT nebel_is_x86_32 AND CMAKE_C_COMPILER_ID STREQUAL GNU AND "avx2" IN_LIST nebel_levels)
    include(CheckCCompilerFlag)
    set(unaligned_moves -Wa,-muse-unaligned-vector-move)
    check_c_compiler_flag(${unaligned_moves} NEBEL_HAVE_UNALIGNED_MOVES)
    if(NEBEL_HAVE_UNALIGNED_MOVES)
        list(APPEND nebel_flags_avx2 ${unaligned_moves})
        list(APPEND nebel_flags_avx512 ${unaligned_moves})
    else()
        message(STATUS "nebel: built without AVX2 and AVX-512; on Windows gcc needs binutils 2.38 for them")
        list(REMOVE_ITEM nebel_levels avx2 avx512)
    endif()
endif()

# The condition of formulas/quad.h.
include(CheckCSourceCompiles)
check_c_source_compiles("#include <float.h>
#if !defined(__SIZEOF_FLOAT128__) || LDBL_MANT_DIG >= 113
#error long double is the widest type
#endif
int main(void) { return 0; }" NEBEL_HAVE_QUAD)

function(nebel_add_kernel file level)
    get_filename_component(stem ${file} NAME_WE)
    set(target nebel_${stem}_${level})
    string(TOUPPER ${level} upper)
    add_library(${target} OBJECT ${file})
    nebel_set_options(${target})
    target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(${target} PRIVATE NB_ISA_${upper}=1 NB_SUFFIX=${level})
    # gcc's note that vectors wider than the base level change the calling convention: the kernels pass none between objects.
    target_compile_options(${target} PRIVATE -Wno-psabi ${nebel_flags_${level}})
    # The march, air and pictures are full of loops over three colors, which -O2 leaves in memory.
    if(stem MATCHES "^(trace|in_scattering|sky_view|picture)_kernel$" AND CMAKE_C_COMPILER_ID STREQUAL GNU AND NOT NEBEL_SANITIZE)
        target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O3>)
    endif()
endfunction()

# Returns the objects of all kernels and the NB_HAVE_ definitions that tell the dispatcher which there are.
function(nebel_add_kernels objects definitions)
    set(all "")
    foreach(file IN LISTS nebel_kernel_files)
        if(NOT EXISTS ${file})
            continue()
        endif()
        get_filename_component(stem ${file} NAME_WE)
        set(levels ${nebel_levels})
        if(stem STREQUAL trace_kernel)
            list(APPEND levels double)
            if(NEBEL_HAVE_QUAD)
                list(APPEND levels quad)
            endif()
        endif()
        foreach(level IN LISTS levels)
            nebel_add_kernel(${file} ${level})
            list(APPEND all $<TARGET_OBJECTS:nebel_${stem}_${level}>)
        endforeach()
    endforeach()
    set(have "")
    foreach(level IN LISTS nebel_levels)
        string(TOUPPER ${level} upper)
        list(APPEND have NB_HAVE_${upper}=1)
    endforeach()
    set(${objects} ${all} PARENT_SCOPE)
    set(${definitions} ${have} PARENT_SCOPE)
endfunction()
