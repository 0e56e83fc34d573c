#include <gtest/gtest.h>

#include <cstdlib>

int main(int argc, char** argv) {
    // The validation layers run in every test; GLINT_VALIDATION=0 in the environment turns them off.
    ::setenv("GLINT_VALIDATION", "1", 0);
    ::testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
