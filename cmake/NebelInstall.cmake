# Headers, libraries, program, pkg-config files and the CMake package. One set of files per library, so that a program that
# uses the core alone needs none of the libraries around it.

include(CMakePackageConfigHelpers)
set(nebel_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/nebel)

# The package files find the libraries beside them, so that a prefix can be moved; absolute directories stay as they are.
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}" OR IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
    set(pc_prefix ${CMAKE_INSTALL_PREFIX})
    set(pc_libdir ${CMAKE_INSTALL_FULL_LIBDIR})
    set(pc_includedir ${CMAKE_INSTALL_FULL_INCLUDEDIR})
    set(pc_bindir ${CMAKE_INSTALL_FULL_BINDIR})
else()
    file(RELATIVE_PATH pc_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
    string(REGEX REPLACE "/$" "" pc_prefix "\${pcfiledir}/${pc_prefix}")
    set(pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
    set(pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
    set(pc_bindir "\${prefix}/${CMAKE_INSTALL_BINDIR}")
endif()

# On a static library the private dependencies are the caller's to link; on a shared one they are not.
function(nebel_write_pkgconfig name description requires private_requires private_libs)
    set(pc_name ${name})
    set(pc_description ${description})
    if(BUILD_SHARED_LIBS)
        set(pc_requires "${requires}")
        set(pc_requires_private "${private_requires}")
        set(pc_libs "")
        set(pc_libs_private "${private_libs}")
    else()
        string(STRIP "${requires} ${private_requires}" pc_requires)
        set(pc_requires_private "")
        set(pc_libs " ${private_libs}")
        set(pc_libs_private "")
    endif()
    configure_file(${PROJECT_SOURCE_DIR}/cmake/library.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()

function(nebel_install_library name)
    install(TARGETS ${name} EXPORT ${name}_targets)
    foreach(header IN LISTS ARGN)
        install(FILES ${PROJECT_SOURCE_DIR}/include/nebel/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nebel)
    endforeach()
    install(EXPORT ${name}_targets NAMESPACE nebel:: DESTINATION ${nebel_package_dir})
endfunction()

nebel_install_library(nebel nebel.h cells.h classic.h clouds.h diffusion.h environment.h layers.h nebula.h places.h planet.h
    shader.h)
nebel_write_pkgconfig(nebel "Exact fog for any renderer" "" "" "-lm")
if(TARGET nebel_scene)
    nebel_install_library(nebel_scene scene.h photograph.h)
    install(TARGETS nebel_read_model)
    set(webp "")
    set(openvdb "")
    if(nebel_with_openvdb)
        set(openvdb "-lopenvdb -ltbb -lImath -lstdc++ ")
    endif()
    if(nebel_with_webp)
        set(webp " libwebpmux libwebp")
    endif()
    # For hosts that are told where the prefix has been moved to.
    set(pc_variables "model_reader=${pc_bindir}/nebel-read-model\n")
    nebel_write_pkgconfig(nebel_scene "Scene files, models and pictures for nebel" nebel
        "assimp libpng libjpeg yajl zlib blosc OpenEXR${webp}" "${openvdb}-lm")
    set(pc_variables "")
endif()
if(TARGET nebel_cpu)
    nebel_install_library(nebel_cpu render.h)
    # The run time by its path where a flag would ask for that of the caller's compiler, which may be another.
    set(openmp ${OpenMP_C_FLAGS})
    if(NOT CMAKE_C_COMPILER_ID STREQUAL "GNU")
        set(openmp "")
        foreach(part IN LISTS OpenMP_C_LIB_NAMES)
            list(APPEND openmp ${OpenMP_${part}_LIBRARY})
        endforeach()
    endif()
    list(JOIN openmp " " openmp)
    nebel_write_pkgconfig(nebel_cpu "The nebel CPU renderer" nebel_scene "" "-lembree3 ${openmp} -lm")
endif()
if(TARGET nebel_gl)
    nebel_install_library(nebel_gl gl.h gl_classic.h gl_render.h scene.h)
    nebel_write_pkgconfig(nebel_gl "Fog in OpenGL and OpenGL ES" nebel epoxy "-lm")
endif()
if(TARGET nebel_tool)
    install(TARGETS nebel_tool)
endif()
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
    DESTINATION ${CMAKE_INSTALL_DOCDIR})
# What headers and messages point to, by the names that they use.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DOCDIR}
    PATTERN internal.md EXCLUDE PATTERN CMakeLists.txt EXCLUDE)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/nebelConfig.cmake.in ${PROJECT_BINARY_DIR}/nebelConfig.cmake
    INSTALL_DESTINATION ${nebel_package_dir} PATH_VARS CMAKE_INSTALL_BINDIR NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/nebelConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nebelConfig.cmake ${PROJECT_BINARY_DIR}/nebelConfigVersion.cmake
    cmake/NebelDependencies.cmake DESTINATION ${nebel_package_dir})
