# The parts of the library, and the library.

set_property(GLOBAL PROPERTY GLINT_MODULES "")
set_property(GLOBAL PROPERTY GLINT_LINKS "")

# glint_module(name folder libraries...): object library glint_<name> from the sources below a folder.
function(glint_module name folder)
    if(GLINT_FUZZ AND NOT name MATCHES "^(base|math|format)$")
        return()
    endif()
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*.cpp")
    if(NOT sources)
        return()
    endif()
    add_library(glint_${name} OBJECT ${sources})
    target_include_directories(glint_${name} PUBLIC "${PROJECT_BINARY_DIR}/include" PRIVATE "${PROJECT_SOURCE_DIR}")
    target_link_libraries(glint_${name} PUBLIC tl::expected glm::glm PRIVATE glint_strict_options ${ARGN})
    # Errors name lines; installed files name no folder of the machine that they were built on.
    target_compile_options(glint_${name} PRIVATE "-ffile-prefix-map=${PROJECT_SOURCE_DIR}/=")
    set_property(GLOBAL APPEND PROPERTY GLINT_MODULES glint_${name})
    set_property(GLOBAL APPEND PROPERTY GLINT_LINKS ${ARGN})
endfunction()

# glint_embed_shaders(name folder): compiles the files below a folder into module glint_<name>, to be found through
# <glint/shader/embedded.h>.
function(glint_embed_shaders name folder)
    if(NOT TARGET glint_${name})
        return()
    endif()
    set(source "${PROJECT_BINARY_DIR}/embedded_shaders.cpp")
    set(script "${PROJECT_SOURCE_DIR}/cmake/embed_shaders.cmake")
    file(GLOB_RECURSE files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*.h")
    # A removed file must lead to a new table too: the list of files is a dependency of its own.
    set(list "${PROJECT_BINARY_DIR}/embedded_shaders.txt")
    file(GENERATE OUTPUT "${list}" CONTENT "$<JOIN:${files},\n>\n")
    add_custom_command(OUTPUT "${source}"
        COMMAND ${CMAKE_COMMAND} "-DFOLDER=${PROJECT_SOURCE_DIR}/${folder}" "-DOUTPUT=${source}" -P "${script}"
        DEPENDS ${files} "${list}" "${script}"
        COMMENT "Embedding ${folder}" VERBATIM)
    target_sources(glint_${name} PRIVATE "${source}")
endfunction()

# glint_public_headers(result): the headers below core/ that users may include, relative to core/. Internal ones lie in
# core/MODULE/detail/ or say "For sources only".
function(glint_public_headers result)
    file(GLOB_RECURSE headers RELATIVE "${PROJECT_SOURCE_DIR}/core" CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/core/*.h")
    list(FILTER headers EXCLUDE REGEX "/detail/")
    set(public "")
    foreach(header IN LISTS headers)
        file(STRINGS "${PROJECT_SOURCE_DIR}/core/${header}" internal REGEX "For sources only" LIMIT_COUNT 1)
        if(NOT internal)
            list(APPEND public "${header}")
        endif()
    endforeach()
    set(${result} "${public}" PARENT_SCOPE)
endfunction()

# glint_library(): the static library glint and the shared one glint_shared, both of the modules' object files, which link
# privately what the modules need. BUILD_SHARED_LIBS says which of them is glint::glint, is built by default and is what
# users install. Tests and examples link glint: they look inside, and the shared library shows only what is public.
function(glint_library)
    get_property(modules GLOBAL PROPERTY GLINT_MODULES)
    get_property(links GLOBAL PROPERTY GLINT_LINKS)
    list(REMOVE_DUPLICATES links)
    if(NOT modules)
        message(FATAL_ERROR "None of Glint's folders holds a source")
    endif()
    # Libraries that are only headers were wanted for compiling. Our own targets stand for what they name.
    set(needed "")
    foreach(link IN LISTS links)
        set(behind "${link}")
        if(TARGET ${link})
            get_target_property(type ${link} TYPE)
            if(type STREQUAL "INTERFACE_LIBRARY")
                get_target_property(behind ${link} INTERFACE_LINK_LIBRARIES)
            endif()
        endif()
        if(behind)
            list(APPEND needed ${behind})
        endif()
    endforeach()

    list(TRANSFORM modules REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
    add_library(glint STATIC ${objects})
    add_library(glint_shared SHARED ${objects})
    foreach(target glint glint_shared)
        set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME glint EXPORT_NAME glint)
        target_compile_features(${target} PUBLIC cxx_std_20)
        target_include_directories(${target} INTERFACE
            "$<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
        target_link_libraries(${target} PUBLIC tl::expected glm::glm PRIVATE ${needed})
    endforeach()

    # Before 1.0 every minor version may change the interface.
    set_target_properties(glint_shared PROPERTIES
        VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
    set(map "${PROJECT_BINARY_DIR}/glint.map")
    set(script "${PROJECT_SOURCE_DIR}/cmake/list_exports.cmake")
    add_custom_command(OUTPUT "${map}"
        COMMAND ${CMAKE_COMMAND} "-DNM=${CMAKE_NM}" "-DLIBRARY=$<TARGET_FILE:glint>" "-DOUTPUT=${map}" -P "${script}"
        DEPENDS glint "${script}"
        COMMENT "Listing what the shared library exports" VERBATIM)
    add_custom_target(glint_exports DEPENDS "${map}")
    add_dependencies(glint_shared glint_exports)
    set_target_properties(glint_shared PROPERTIES LINK_DEPENDS "${map}")
    target_link_options(glint_shared PRIVATE "LINKER:--version-script=${map}" "LINKER:-z,defs")

    if(BUILD_SHARED_LIBS)
        add_library(glint::glint ALIAS glint_shared)
        set_target_properties(glint PROPERTIES EXCLUDE_FROM_ALL ON)
    else()
        add_library(glint::glint ALIAS glint)
        set_target_properties(glint_shared PROPERTIES EXCLUDE_FROM_ALL ON)
    endif()
endfunction()
