#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace glint::detail {

/// What is wrong with a JSON text, "" if nothing is: what is no JSON, a key that stands twice in one object, values
/// that are nested more than `max_depth` deep. The library's own documents would pass over the last two.
std::string checkJson(std::string_view text, size_t max_depth);

}  // namespace glint::detail
