#pragma once

// What went wrong, for EXPECT_THAT: `EXPECT_THAT(device.createBuffer(flags, 0), HasErrorId("buffer.size_zero"));` and
// `ASSERT_THAT(kernel.create(), IsOk());`. For Error, Status, Expected and every handle.

#include <glint/base/error.h>

#include <gmock/gmock.h>

#include <string>

namespace glint::test {

/// The error that a value carries, or none.
template <class T>
Error errorOf(const T& value) {
    if constexpr (std::is_same_v<T, Error>) {
        return value;
    } else if constexpr (requires { value.has_value(); }) {
        return value.has_value() ? Error() : value.error();
    } else {
        return value.error();
    }
}

MATCHER_P(HasErrorId, expected_id, std::string(negation ? "has no" : "has an") + " error '" + expected_id + "'") {
    const Error error = errorOf(arg);
    if (error)
        *result_listener << "the error is: " << error.text();
    else
        *result_listener << "there is no error";
    return error.id() == expected_id;
}

MATCHER(IsOk, negation ? "has an error" : "has no error") {
    const Error error = errorOf(arg);
    if (error) *result_listener << "the error is: " << error.text();
    return !error;
}

}  // namespace glint::test
