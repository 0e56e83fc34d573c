# What nearly every test includes, parsed once: a quarter of the time that tests take to compile.
function(glint_precompile_test_headers)
    file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp" "")
    add_executable(test_headers EXCLUDE_FROM_ALL "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp")
    target_link_libraries(test_headers PRIVATE glint_options test_support)
    target_compile_options(test_headers PRIVATE -O0)
    target_precompile_headers(test_headers PRIVATE <gmock/gmock.h> <gtest/gtest.h> <fmt/format.h> <algorithm> <array>
        <cmath> <filesystem> <fstream> <functional> <map> <memory> <random> <span> <string> <thread> <vector>)
endfunction()

# glint_test(name labels sources...): a GoogleTest program and its ctest entry. Suites whose name ends in `Long` go to a
# second entry, labelled `long`, if there are any.

set(GLINT_TEST_TIMEOUT 900)

function(glint_test name labels)
    add_executable(${name} ${ARGN})
    target_link_libraries(${name} PRIVATE glint_options test_support)
    # Checks are compiled more often than they are run.
    target_compile_options(${name} PRIVATE -O0)
    target_precompile_headers(${name} REUSE_FROM test_headers)
    if(NOT EXISTS "${PROJECT_SOURCE_DIR}/tests/support/main.cpp")
        target_link_libraries(${name} PRIVATE GTest::gtest_main)
    endif()
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1 "--gtest_filter=-*Long.*:*Long/*")
    set(environment "")
    if(GLINT_SANITIZE)
        target_sources(${name} PRIVATE "${PROJECT_SOURCE_DIR}/cmake/sanitizers/keep_loaded.cpp")
        set(folder "${PROJECT_SOURCE_DIR}/cmake/sanitizers")
        set(environment
            "ASAN_OPTIONS=detect_leaks=1:check_initialization_order=1:strict_init_order=1"
            "LSAN_OPTIONS=suppressions=${folder}/lsan.supp:print_suppressions=0"
            "UBSAN_OPTIONS=print_stacktrace=1"
            "TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1")
    endif()
    set_tests_properties(${name} PROPERTIES LABELS "${labels}" TIMEOUT ${GLINT_TEST_TIMEOUT} ENVIRONMENT "${environment}")

    if("threads" IN_LIST labels)
        add_dependencies(thread_tests ${name})
    endif()

    set(long "")
    foreach(source IN LISTS ARGN)
        file(STRINGS "${source}" found REGEX "^(TEST|TEST_F|TEST_P|TYPED_TEST)\\([A-Za-z0-9_]*Long,")
        list(APPEND long ${found})
    endforeach()
    if(long)
        add_test(NAME ${name}_long COMMAND ${name} --gtest_brief=1 "--gtest_filter=*Long.*:*Long/*")
        set_tests_properties(${name}_long PROPERTIES
            LABELS "${labels};long" TIMEOUT 7200 ENVIRONMENT "${environment}")
    endif()
endfunction()

# glint_test_again(name variant filter environment): the test program once more, with these tests and variables.
function(glint_test_again name variant filter environment)
    add_test(NAME ${name}_${variant} COMMAND ${name} --gtest_brief=1 "--gtest_filter=${filter}")
    get_test_property(${name} LABELS labels)
    get_test_property(${name} ENVIRONMENT common)
    set_tests_properties(${name}_${variant} PROPERTIES
        LABELS "${labels}" TIMEOUT ${GLINT_TEST_TIMEOUT} ENVIRONMENT "${common};${environment}")
endfunction()
