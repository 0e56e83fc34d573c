#include "progress.h"

#include <fmt/format.h>

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>

using namespace glint;

namespace tool {

namespace {

volatile std::sig_atomic_t interrupted = 0;
timespec first_signal = {};

// Programs like timeout(1) send the same signal to a process and to its group: what comes right after the first is no
// second wish.
void onSignal(int signal) {
    timespec time;
    ::clock_gettime(CLOCK_MONOTONIC, &time);
    if (!interrupted) {
        first_signal = time;
        interrupted = 1;
        return;
    }
    const auto seconds = static_cast<double>(time.tv_sec - first_signal.tv_sec) +
                         1e-9 * static_cast<double>(time.tv_nsec - first_signal.tv_nsec);
    if (seconds < 0.25) return;
    ::signal(signal, SIG_DFL);
    ::raise(signal);
}

}  // namespace

void catchSignals() {
    struct sigaction action = {};
    action.sa_handler = onSignal;
    action.sa_flags = SA_RESTART;
    // One handler at a time.
    ::sigaddset(&action.sa_mask, SIGINT);
    ::sigaddset(&action.sa_mask, SIGTERM);
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
