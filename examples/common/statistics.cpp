#include "common/statistics.h"

#include <glint/base/file.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace {

double medianOf(std::vector<uint64_t> times) {
    if (times.empty()) return 0.0;
    std::sort(times.begin(), times.end());
    const size_t middle = times.size() / 2;
    const auto upper = static_cast<double>(times[middle]);
    return times.size() % 2 ? upper : (static_cast<double>(times[middle - 1]) + upper) / 2;
}

}  // namespace

void Statistics::addPass(const std::string& name, uint64_t nanoseconds) {
    auto pass = std::find_if(passes_.begin(), passes_.end(), [&](const Pass& each) { return each.name == name; });
    if (pass == passes_.end()) pass = passes_.insert(pass, Pass{.name = name, .times = {}});
    pass->times.push_back(nanoseconds);
}

void Statistics::setRays(const std::string& pass, uint64_t rays) {
    ray_pass_ = pass;
    rays_ = rays;
}

const std::vector<uint64_t>& Statistics::times(const std::string& pass) const {
    static const std::vector<uint64_t> none;
    for (const Pass& each : passes_)
        if (each.name == pass) return each.times;
    return none;
}

double Statistics::median(const std::string& pass) const { return medianOf(times(pass)); }

std::vector<std::string> Statistics::passNames() const {
    std::vector<std::string> names;
    for (const Pass& each : passes_) names.push_back(each.name);
    return names;
}

double Statistics::last(const std::string& pass) const {
    return times(pass).empty() ? 0.0 : static_cast<double>(times(pass).back());
}

std::string Statistics::text() const {
    nlohmann::ordered_json json = {{"example", example}, {"width", width}, {"height", height}, {"frames", frames}};
    const auto addText = [&](const char* key, const std::string& value) {
        if (!value.empty()) json[key] = value;
    };
    addText("adapter", adapter);
    addText("driver", driver);
    addText("api", api);
    addText("tracing", tracing);
    if (!features.empty()) json["features"] = features;
    if (!counts.empty()) json["counts"] = counts;
    if (!series.empty()) json["series"] = series;
    if (rays_ && median(ray_pass_) > 0.0)
        json["rays_per_second"] = static_cast<double>(rays_) * 1e9 / median(ray_pass_);
    if (!passes_.empty()) {
        auto& passes = json["passes"] = nlohmann::ordered_json::array();
        for (const Pass& pass : passes_)
            passes.push_back({{"name", pass.name},
                              {"gpu_ns", pass.times},
                              {"median_ns", medianOf(pass.times)},
                              {"min_ns", *std::min_element(pass.times.begin(), pass.times.end())}});
    }
    // Names come from drivers: bytes that are no UTF-8 must not stop the writing.
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

glint::Status Statistics::write(const std::filesystem::path& path) const { return glint::writeTextFile(path, text()); }
