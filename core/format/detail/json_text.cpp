#include <glint/format/detail/json_text.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <set>
#include <vector>

namespace glint::detail {

namespace {

using nlohmann::json;

/// Reads a text without keeping anything.
class TextCheck : public nlohmann::json_sax<json> {
public:
    explicit TextCheck(size_t max_depth) : max_depth_(max_depth) {}

    const std::string& complaint() const { return complaint_; }

    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool string(string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_object(size_t) override { return open(); }
    bool end_object() override { return close(); }
    bool start_array(size_t) override { return open(); }
    bool end_array() override { return close(); }
    bool key(string_t& name) override {
        if (keys_.back().insert(name).second) return true;
        complaint_ = fmt::format("the key '{}' stands twice in one object", name);
        return false;
    }
    bool parse_error(size_t byte, const std::string&, const nlohmann::detail::exception& error) override {
        // Its message repeats the place, and names the library's own rules.
        complaint_ =
            fmt::format("the text is no JSON from byte {} on: {}", byte, std::string_view(error.what()).substr(0, 200));
        return false;
    }

private:
    bool open() {
        keys_.emplace_back();
        if (keys_.size() <= max_depth_) return true;
        complaint_ = fmt::format("values are nested more than {} deep", max_depth_);
        return false;
    }
    bool close() {
        keys_.pop_back();
        return true;
    }

    const size_t max_depth_;
    std::vector<std::set<std::string>> keys_;  // of the objects and arrays around
    std::string complaint_;
};

}  // namespace

std::string checkJson(std::string_view text, size_t max_depth) {
    TextCheck check(max_depth);
    json::sax_parse(text.begin(), text.end(), &check);
    return check.complaint();
}

}  // namespace glint::detail
