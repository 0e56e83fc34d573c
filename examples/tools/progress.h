#pragma once

// Long work: how far it is, and whether somebody wants it to end.

#include <glint/base/status.h>

#include <cstdint>
#include <string>

namespace tool {

/// From here on SIGINT and SIGTERM only say that they came; a second one, a quarter of a second later or more, ends the
/// program as ever.
void catchSignals();
/// "tool.interrupted" once a signal came. `rest`: what became of the work.
glint::Status checkInterrupt(const char* rest = "nothing is left behind");

/// Seconds since some moment.
double now();

/// A line on stderr that is written over, if a person is looking; gone with the object.
class Progress {
public:
    /// `unit`: what the speed counts in, such as "million rays", of which one is `scale` of the total's.
    Progress(uint64_t total, std::string unit, double scale = 1.0);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void update(uint64_t done);

private:
    uint64_t total_;
    std::string unit_;
    double scale_;
    bool shown_;
    bool drawn_ = false;
    double begin_;
    double last_ = 0.0;
};

}  // namespace tool
