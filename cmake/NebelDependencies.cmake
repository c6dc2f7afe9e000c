# What the layers around the core link with. Used by the build and by the installed package, so that both find the same.
# Each function takes REQUIRED or QUIET and sets <layer>_found.

# An imported target for a library that ships no package file of its own.
function(nebel_import_library target header library)
    if(TARGET ${target})
        return()
    endif()
    find_path(${target}_include ${header})
    find_library(${target}_library NAMES ${library})
    mark_as_advanced(${target}_include ${target}_library)
    if(${target}_include AND ${target}_library)
        add_library(${target} UNKNOWN IMPORTED GLOBAL)
        set_target_properties(${target} PROPERTIES
            IMPORTED_LOCATION "${${target}_library}"
            INTERFACE_INCLUDE_DIRECTORIES "${${target}_include}")
    endif()
endfunction()

# Fails with the missing targets named where they are required.
function(nebel_check_targets result mode)
    set(missing "")
    foreach(target IN LISTS ARGN)
        if(NOT TARGET ${target})
            list(APPEND missing ${target})
        endif()
    endforeach()
    set(${result} TRUE PARENT_SCOPE)
    if(missing)
        set(${result} FALSE PARENT_SCOPE)
        if(mode STREQUAL REQUIRED)
            message(FATAL_ERROR "nebel: not found: ${missing}. On Debian run scripts/install_packages.sh; "
                "or build without (-DNEBEL_BUILD_SCENE=OFF -DNEBEL_BUILD_CPU=OFF -DNEBEL_BUILD_GL=OFF).")
        endif()
    endif()
endfunction()

# The C core of OpenEXR only: the C++ libraries beside it would be loaded for nothing at every start.
function(nebel_import_openexr_core)
    pkg_check_modules(nebel_openexr QUIET OpenEXR>=3.1)
    set(names ${nebel_openexr_LIBRARIES})
    list(FILTER names INCLUDE REGEX "OpenEXRCore")
    if(NOT names OR TARGET nebel_openexr_core)
        return()
    endif()
    find_library(nebel_openexr_core_library NAMES ${names} HINTS ${nebel_openexr_LIBRARY_DIRS})
    mark_as_advanced(nebel_openexr_core_library)
    if(nebel_openexr_core_library)
        add_library(nebel_openexr_core UNKNOWN IMPORTED GLOBAL)
        set_target_properties(nebel_openexr_core PROPERTIES
            IMPORTED_LOCATION "${nebel_openexr_core_library}"
            INTERFACE_INCLUDE_DIRECTORIES "${nebel_openexr_INCLUDE_DIRS}")
    endif()
endfunction()

set(nebel_scene_dependencies PkgConfig::nebel_assimp PkgConfig::nebel_png PkgConfig::nebel_jpeg PkgConfig::nebel_yajl
    nebel_openexr_core)
macro(nebel_find_scene_dependencies mode)
    find_package(PkgConfig QUIET)
    if(PkgConfig_FOUND)
        pkg_check_modules(nebel_assimp QUIET IMPORTED_TARGET GLOBAL assimp)
        pkg_check_modules(nebel_png QUIET IMPORTED_TARGET GLOBAL libpng)
        pkg_check_modules(nebel_jpeg QUIET IMPORTED_TARGET GLOBAL libjpeg)
        pkg_check_modules(nebel_yajl QUIET IMPORTED_TARGET GLOBAL yajl)
        nebel_import_openexr_core()
    endif()
    nebel_check_targets(nebel_scene_found ${mode} ${nebel_scene_dependencies})
endmacro()

set(nebel_cpu_dependencies nebel_embree OpenMP::OpenMP_C)
macro(nebel_find_cpu_dependencies mode)
    nebel_import_library(nebel_embree embree3/rtcore.h embree3)
    find_package(OpenMP QUIET COMPONENTS C)
    nebel_check_targets(nebel_cpu_found ${mode} ${nebel_cpu_dependencies})
endmacro()

set(nebel_gl_dependencies PkgConfig::nebel_epoxy)
macro(nebel_find_gl_dependencies mode)
    find_package(PkgConfig QUIET)
    if(PkgConfig_FOUND)
        pkg_check_modules(nebel_epoxy QUIET IMPORTED_TARGET GLOBAL epoxy)
    endif()
    nebel_check_targets(nebel_gl_found ${mode} ${nebel_gl_dependencies})
endmacro()

set(nebel_viewer_dependencies PkgConfig::nebel_glfw PkgConfig::nebel_imgui ${nebel_gl_dependencies})
macro(nebel_find_viewer_dependencies mode)
    find_package(PkgConfig QUIET)
    if(PkgConfig_FOUND)
        pkg_check_modules(nebel_glfw QUIET IMPORTED_TARGET GLOBAL glfw3>=3.3)
        pkg_check_modules(nebel_imgui QUIET IMPORTED_TARGET GLOBAL imgui>=1.86)
    endif()
    nebel_check_targets(nebel_viewer_found ${mode} ${nebel_viewer_dependencies})
endmacro()
