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
    file(GLOB_RECURSE files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*")
    # A removed file must lead to a new table too: the list of files is a dependency of its own.
    set(list "${PROJECT_BINARY_DIR}/embedded_shaders.txt")
    file(GENERATE OUTPUT "${list}" CONTENT "$<JOIN:${files},\n>\n")
    add_custom_command(OUTPUT "${source}"
        COMMAND ${CMAKE_COMMAND} "-DFOLDER=${PROJECT_SOURCE_DIR}/${folder}" "-DOUTPUT=${source}" -P "${script}"
        DEPENDS ${files} "${list}" "${script}"
        COMMENT "Embedding ${folder}" VERBATIM)
    target_sources(glint_${name} PRIVATE "${source}")
endfunction()

# glint_library(): target glint, which links privately what its modules need.
function(glint_library)
    get_property(modules GLOBAL PROPERTY GLINT_MODULES)
    get_property(links GLOBAL PROPERTY GLINT_LINKS)
    list(REMOVE_DUPLICATES links)
    if(NOT modules)
        message(FATAL_ERROR "None of Glint's folders holds a source")
    endif()
    list(TRANSFORM modules REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
    add_library(glint ${objects})
    add_library(glint::glint ALIAS glint)
    set_target_properties(glint PROPERTIES LINKER_LANGUAGE CXX VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})
    target_compile_features(glint PUBLIC cxx_std_20)
    target_include_directories(glint INTERFACE "${PROJECT_BINARY_DIR}/include")
    target_link_libraries(glint PUBLIC tl::expected glm::glm PRIVATE ${links})
endfunction()
