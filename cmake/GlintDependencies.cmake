# Everything comes from the distribution; see `./dev setup --list`.

find_package(Threads REQUIRED)  # glslang's package refers to it without finding it
find_package(VulkanHeaders CONFIG REQUIRED)
find_package(SPIRV-Tools CONFIG REQUIRED)
find_package(SPIRV-Tools-opt CONFIG REQUIRED)
find_package(SPIRV-Tools-link CONFIG QUIET)
find_package(glslang CONFIG REQUIRED)
foreach(part core glsl hlsl msl)
    find_package(spirv_cross_${part} CONFIG REQUIRED)
endforeach()
find_package(fmt CONFIG REQUIRED)
find_package(glm CONFIG REQUIRED)
find_package(tl-expected CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(CLI11 CONFIG REQUIRED)
find_package(PNG REQUIRED)
find_package(tinyobjloader CONFIG REQUIRED)
find_package(TinyGLTF CONFIG REQUIRED)
find_package(meshoptimizer CONFIG REQUIRED)
# Compiled against, and opened when it is needed: see examples/tools/import_mesh.cpp.
find_package(assimp CONFIG REQUIRED)
add_library(glint_assimp INTERFACE)
get_target_property(include assimp::assimp INTERFACE_INCLUDE_DIRECTORIES)
if(include)
    target_include_directories(glint_assimp SYSTEM INTERFACE ${include})
endif()
string(REGEX MATCH "^[0-9]+\\.[0-9]+" version "${assimp_VERSION}")
string(REGEX MATCH "^[0-9]+" soname "${assimp_VERSION}")
target_compile_definitions(glint_assimp INTERFACE
    "GLINT_ASSIMP_VERSION=\"${version}\"" "GLINT_ASSIMP_SONAME=\"libassimp.so.${soname}\"")
target_link_libraries(glint_assimp INTERFACE ${CMAKE_DL_LIBS})
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)  # Debian's Imath remarks at length that its Python module is not installed
find_package(OpenEXR CONFIG REQUIRED)
unset(CMAKE_MESSAGE_LOG_LEVEL)
find_package(glfw3 CONFIG REQUIRED)

find_path(GLINT_VMA_INCLUDE_DIR vk_mem_alloc.h REQUIRED)
add_library(glint_vma INTERFACE)
target_include_directories(glint_vma SYSTEM INTERFACE "${GLINT_VMA_INCLUDE_DIR}")

target_compile_definitions(glint_vma INTERFACE VK_NO_PROTOTYPES)

find_path(GLINT_XXHASH_INCLUDE_DIR xxhash.h REQUIRED)
find_library(GLINT_XXHASH_LIBRARY xxhash REQUIRED)
add_library(glint_xxhash INTERFACE)
target_include_directories(glint_xxhash SYSTEM INTERFACE "${GLINT_XXHASH_INCLUDE_DIR}")
target_link_libraries(glint_xxhash INTERFACE xxhash)  # by name: its path here is nobody else's

find_path(GLINT_TURBOJPEG_INCLUDE_DIR turbojpeg.h REQUIRED)
find_library(GLINT_TURBOJPEG_LIBRARY turbojpeg REQUIRED)
add_library(glint_turbojpeg INTERFACE)
target_include_directories(glint_turbojpeg SYSTEM INTERFACE "${GLINT_TURBOJPEG_INCLUDE_DIR}")
target_link_libraries(glint_turbojpeg INTERFACE turbojpeg)

find_path(GLINT_STB_INCLUDE_DIR stb/stb_image.h REQUIRED)
add_library(glint_stb INTERFACE)
target_include_directories(glint_stb SYSTEM INTERFACE "${GLINT_STB_INCLUDE_DIR}")
