#include "progress.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>

using namespace glint;

namespace tool {

namespace {

volatile std::sig_atomic_t interrupted = 0;

}  // namespace

void catchSignals() {
    struct sigaction action = {};
    action.sa_handler = [](int) { interrupted = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
}

Status checkInterrupt(const char* rest) {
    if (!interrupted) return {};
    return Error::inFile(ErrorCode::InvalidArgument, "tool.interrupted", fmt::format("interrupted, {}", rest), {}, 0);
}

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

Progress::Progress(uint64_t total, std::string unit, double scale)
    : total_(std::max<uint64_t>(total, 1)),
      unit_(std::move(unit)),
      scale_(scale),
      shown_(::isatty(STDERR_FILENO) != 0),
      begin_(now()) {}

Progress::~Progress() {
    if (drawn_) fmt::print(stderr, "\r\x1b[K");
}

void Progress::update(uint64_t done) {
    const double time = now();
    if (!shown_ || time - last_ < 0.1) return;
    last_ = time;
    drawn_ = true;
    const double share = std::min(static_cast<double>(done) / static_cast<double>(total_), 1.0);
    const double speed = static_cast<double>(done) / (time - begin_);
    const auto filled = static_cast<int>(share * 30);
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:3.0f} %  {:.2f} {} a second, {:.0f} s left\x1b[K", "", filled, "",
               30 - filled, share * 100, speed * scale_, unit_, (1.0 - share) * static_cast<double>(total_) / speed);
    std::fflush(stderr);
}

}  // namespace tool
