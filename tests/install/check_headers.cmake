# cmake -DCOMPILER=... -DFLAGS=... -DSOURCES=... -P check_headers.cmake: fails when one of the sources, directly or not,
# includes a header that public headers must not expose.

set(forbidden "/(vulkan|vk_video|GL|GLES[0-9]*|EGL|KHR|GLFW|glslang|spirv-tools|spirv_cross|spirv|fmt|nlohmann)/|/(volk|vk_mem_alloc|png|tiny_obj_loader|xxhash)\\.h")
set(failed FALSE)
foreach(source IN LISTS SOURCES)
    execute_process(COMMAND ${COMPILER} ${FLAGS} -M "${source}"
        OUTPUT_VARIABLE dependencies ERROR_VARIABLE errors RESULT_VARIABLE result)
    cmake_path(GET source STEM name)
    if(NOT result EQUAL 0)
        message("${name}: ${errors}")
        set(failed TRUE)
    endif()
    string(REGEX MATCHALL "[^ \n\\]+" dependencies "${dependencies}")
    list(FILTER dependencies INCLUDE REGEX "${forbidden}")
    if(dependencies)
        list(GET dependencies 0 first)
        message("${name} includes ${first}")
        set(failed TRUE)
    endif()
endforeach()
if(failed)
    message(FATAL_ERROR "Public headers are not clean")
endif()
