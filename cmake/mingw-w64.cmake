# Windows on x86-64, built with Debian's MinGW: cmake --toolchain cmake/mingw-w64.cmake
if(NOT DEFINED nebel_windows_processor)
    set(nebel_windows_processor x86_64)
endif()
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR ${nebel_windows_processor})
set(CMAKE_C_COMPILER ${nebel_windows_processor}-w64-mingw32-gcc)
set(CMAKE_FIND_ROOT_PATH /usr/${nebel_windows_processor}-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
# Programs and libraries bring what they need of gcc and of winpthreads.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(CMAKE_SHARED_LINKER_FLAGS_INIT -static)
