#pragma once

#include <glint/base/error.h>

#include <tl/expected.hpp>

namespace glint {

/// A value, or the error that says why there is none.
template <class T>
using Expected = tl::expected<T, Error>;

/// `return unexpected(error);` from a function that returns an Expected.
inline tl::unexpected<Error> unexpected(Error error) { return tl::unexpected<Error>(std::move(error)); }

}  // namespace glint
