# Toolchain file: Debian's Clang 19 and libc++ for WebAssembly. docs/web.md says what to install.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(CMAKE_C_COMPILER_TARGET wasm32-wasi)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)  # a program would need a main()

# Debian's libc++ has no exceptions for this target. Threads would need shared memory, which a browser gives only to
# pages from a server that sends certain headers.
set(CMAKE_C_FLAGS_INIT "-msimd128")
set(CMAKE_CXX_FLAGS_INIT "-msimd128 -stdlib=libc++ -fno-exceptions")
# By its path, as Debian calls it by another name than Clang looks for.
find_program(CAROM_WASM_LD wasm-ld-19 REQUIRED)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-fuse-ld=${CAROM_WASM_LD}")
