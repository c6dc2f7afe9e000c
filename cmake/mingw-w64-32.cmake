# Windows on x86 in 32 bits: cmake --toolchain cmake/mingw-w64-32.cmake
set(nebel_windows_processor i686)
include(${CMAKE_CURRENT_LIST_DIR}/mingw-w64.cmake)
