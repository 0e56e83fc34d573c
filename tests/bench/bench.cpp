#include "bench/bench.h"

#include <fmt/format.h>
#include <glint/base/file.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <ctime>
#include <fstream>

namespace glint::bench {

namespace {

double seconds(clockid_t clock) {
    timespec time = {};
    ::clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

}  // namespace

void Report::add(std::string name, double value, std::string unit, std::string against, std::string device) {
    fmt::print("{} = {:.4g} {} (against {})\n\n", name, value, unit, against);
    std::string command = "./dev bench " + name;
    figures_.push_back(
        {std::move(name), value, std::move(unit), std::move(against), std::move(device), std::move(command)});
}

std::filesystem::path Report::folder() const {
    const std::filesystem::path folder = options_.json.parent_path() / "report";
    std::filesystem::create_directories(folder);
    return folder;
}

void Report::write() const {
    if (figures_.empty()) return;
    nlohmann::json kept = nlohmann::json::array();
    if (std::filesystem::exists(options_.json)) {
        const auto text = check(readTextFile(options_.json));
        const auto old = nlohmann::json::parse(*text, nullptr, false);
        if (!old.is_array()) throw std::runtime_error(options_.json.string() + " is not a list of figures");
        for (const auto& figure : old) {
            const auto same = [&](const Figure& each) { return figure.value("name", "") == each.name; };
            if (std::none_of(figures_.begin(), figures_.end(), same)) kept.push_back(figure);
        }
    }
    for (const Figure& figure : figures_) {
        kept.push_back({{"name", figure.name},
                        {"value", figure.value},
                        {"unit", figure.unit},
                        {"against", figure.against},
                        {"device", figure.device},
                        {"command", figure.command}});
    }
    if (options_.json.has_parent_path()) std::filesystem::create_directories(options_.json.parent_path());
    check(writeTextFile(options_.json, kept.dump(2) + "\n"));
}

Device createDevice(TracingEngine tracing) {
    DeviceDesc desc;
    desc.tracing = tracing;
    desc.validation = DeviceDesc::Validation::Off;
    return check(Device::create(desc));
}

std::string processorName() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
    }
    return "unknown processor";
}

std::string deviceName(const Device& device) {
    const DeviceInfo& info = device.getInfo();
    return fmt::format("{}, {}, {}", info.name, info.driver, processorName());
}

double threadSeconds() { return seconds(CLOCK_THREAD_CPUTIME_ID); }
double wallSeconds() { return seconds(CLOCK_MONOTONIC); }

double Times::median() const {
    std::vector<double> sorted = values;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
}

double Times::minimum() const { return *std::min_element(values.begin(), values.end()); }

std::vector<Times> interleave(std::span<const Side> sides, uint32_t warm_up, uint32_t rounds, double (*clock)()) {
    std::vector<Times> times(sides.size());
    for (uint32_t round = 0; round < warm_up + rounds; round++) {
        for (size_t turn = 0; turn < sides.size(); turn++) {
            // To and fro, so that no side always finds the caches as the same other has left them.
            const size_t i = round % 2 == 0 ? turn : sides.size() - 1 - turn;
            const double begin = clock();
            sides[i].timed();
            const double end = clock();
            sides[i].untimed();
            if (round >= warm_up) times[i].values.push_back(end - begin);
        }
    }
    return times;
}

void printTimes(std::string_view label, const Times& times) {
    fmt::print("  {:<36} median {:8.4f} ms   minimum {:8.4f} ms\n", label, times.median() * 1e3, times.minimum() * 1e3);
}

}  // namespace glint::bench
