# Language level, warnings, sanitizers and the compiler cache.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Kind of build" FORCE)
endif()

find_program(GLINT_CCACHE ccache)
if(GLINT_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    # What it has to be told to keep what precompiled headers were used for.
    set(CMAKE_CXX_COMPILER_LAUNCHER
        "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${GLINT_CCACHE}")
endif()

# How Glint's own code is compiled; what users of the library compile with is their affair.
add_library(glint_options INTERFACE)
target_compile_options(glint_options INTERFACE
    -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
    # Vulkan's structures are meant to be filled in part.
    -Wno-missing-field-initializers
    # Contracted multiply-adds would make error bounds, and results, depend on the target.
    -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # A false alarm about std::string's own copies (GCC bug 105651).
    target_compile_options(glint_options INTERFACE -Wno-restrict)
endif()
if(GLINT_WARNINGS_AS_ERRORS)
    target_compile_options(glint_options INTERFACE -Werror)
endif()

# Silent narrowing is a bug in a library of sizes and offsets; tests and examples may be more relaxed.
add_library(glint_strict_options INTERFACE)
target_link_libraries(glint_strict_options INTERFACE glint_options)
target_compile_options(glint_strict_options INTERFACE -Wconversion -Wno-sign-conversion)

if(GLINT_SANITIZE)
    # vptr needs type information that Debian's glslang is built without.
    add_compile_options(-fsanitize=${GLINT_SANITIZE} -fno-omit-frame-pointer -g1)
    add_link_options(-fsanitize=${GLINT_SANITIZE})
    if(GLINT_SANITIZE MATCHES "undefined")
        add_compile_options(-fno-sanitize=vptr -fno-sanitize-recover=undefined)
    endif()
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
        # Instrumented code confuses these into false alarms.
        add_compile_options(-Wno-maybe-uninitialized -Wno-stringop-overflow -Wno-array-bounds -Wno-restrict)
    endif()
endif()
