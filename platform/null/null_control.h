#pragma once

// How tests steer null devices. NullSettings are those of the devices that are created next; a NullControl belongs to
// one device and outlives it, so that a test can count what the device left behind.

#include <platform/null/hazard_checker.h>

#include <glint/base/error.h>
#include <glint/base/status.h>
#include <glint/device/detail/backend.h>

#include <array>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace glint::null {

struct NullSettings {
    FeatureMask missing = 0;       ///< features that the adapter lacks
    uint64_t memory = 1ull << 30;  ///< bytes of all objects together; more fails with OutOfMemory
    bool mapped = false;           ///< device memory has a host address, as on a CPU or an integrated GPU
    std::array<bool, detail::queue_count> queues = {true, true, true};  ///< Queue::Main is always there
    uint64_t fail_creation = 0;  ///< the n-th creation of a native object fails with OutOfMemory; 0: none
    uint64_t fail_submit = 0;    ///< the n-th submission fails with this code; 0: none
    ErrorCode fail_code = ErrorCode::OutOfMemory;  ///< or DeviceLost
    bool judge = true;                             ///< by the hazard checker
    uint64_t group_time = 0;                       ///< nanoseconds of a group of a dispatch, as time queries see it
};

/// Replaces the settings of devices created from now on, until the end of the scope.
class ScopedSettings {
public:
    explicit ScopedSettings(const NullSettings& settings);
    ~ScopedSettings();
    ScopedSettings(const ScopedSettings&) = delete;
    ScopedSettings& operator=(const ScopedSettings&) = delete;

private:
    NullSettings before_;
};

/// What a device has done so far.
struct NullCounters {
    uint64_t creations = 0;  ///< native objects asked for, failed ones included
    uint64_t objects = 0;    ///< native objects alive
    uint64_t bytes = 0;      ///< of those
    uint64_t submits = 0;    ///< tried
    uint64_t waits = 0;      ///< between queues
    uint64_t lists = 0;
    uint64_t commands = 0;
    uint64_t dispatches = 0;
    uint64_t draws = 0;     ///< of an indirect command, each
    uint64_t builds = 0;    ///< and updates of acceleration structures
    uint64_t barriers = 0;  ///< memory barriers
    uint64_t image_barriers = 0;
    uint64_t splits = 0;  ///< of targets
};

/// All methods may be called from any thread.
class NullControl {
public:
    /// Of the device that this process created last, nullptr if it has created none.
    static std::shared_ptr<NullControl> last();

    explicit NullControl(const NullSettings& settings);

    NullCounters counters() const;
    /// What is wrong with what was submitted so far: findings of the checker, and
    /// "null.destroyed_in_use" (a native object was deleted before the queues had passed its last use),
    /// "null.outlived" (a native object was deleted after its back end), "null.undeclared" (a command reaches memory
    /// that no access of it names), "null.range" (a command reaches beyond the end of a buffer or a texture).
    std::vector<Error> findings() const;
    void clearFindings();

    /// The n-th creation, or submission, from now on fails; 0: none.
    void failCreation(uint64_t n);
    void failSubmit(uint64_t n, ErrorCode code);

    /// Submissions to the queue stay undone from now on. What they do to memory is done at once all the same.
    void hold(Queue queue);
    /// Completes what was held back and holds no more.
    void release(Queue queue);
    /// Completes the held submissions up to this value.
    void release(Queue queue, uint64_t value);

    /// What the windows of the device see next and, but for what a user does once, from then on.
    void setWindowEvents(const detail::WindowEvents& events);
    /// The next acquired, or presented, picture of a window turns out to be outdated.
    void outdateWindow();
    /// The window system takes the device's windows away: acquiring and presenting fail with "window.lost".
    void loseWindow();

    /// Called when a window presents a picture, as a display that makes its caller wait.
    void setPresentation(std::function<void()> presentation);

    /// Called with each submission and the checker before it judges it. Must not call this object.
    using Observer = std::function<void(const detail::Submission&, const HazardChecker&)>;
    void setObserver(Observer observer);

    // For the back end.

    const NullSettings& settings() const { return settings_; }

    /// Counts a creation. Errors: "device.out_of_memory".
    Status create(uint64_t bytes);
    /// Takes back what create() counted, as the object is deleted.
    void destroy(uint64_t id, uint64_t bytes, const std::string& name,
                 const std::array<uint64_t, detail::queue_count>& last_use);
    uint64_t nextId();

    /// Counts a submission. Errors: "device.out_of_memory", "device.lost", "null.value".
    Status beginSubmit(const detail::Submission& submission);
    void count(const NullCounters& more);
    void judge(const detail::Submission& submission);
    void report(Error finding);
    void endSubmit(const detail::Submission& submission);
    uint64_t completed(Queue queue) const;
    /// Errors: "fence.timeout", "device.lost".
    Status wait(std::span<const detail::TimelinePoint> points, uint64_t nanoseconds);

    void open(std::function<void(const Error&, bool warning)> message);
    void close();

    detail::WindowEvents takeWindowEvents(const detail::WindowEvents& before);
    bool takeOutdated();
    bool isWindowLost() const;
    void present() const;

private:
    struct Pending {
        uint64_t value = 0;
        std::vector<detail::TimelinePoint> waits;
    };
    struct TimeLine {
        uint64_t submitted = 0;
        uint64_t completed = 0;
        uint64_t released = 0;  ///< while held: up to this value
        bool held = false;
        std::deque<Pending> pending;
    };

    void progress();
    void tell(std::vector<Error> findings);

    const NullSettings settings_;

    mutable std::mutex mutex_;
    std::condition_variable progressed_;
    NullCounters counters_;
    std::vector<Error> findings_;
    std::array<TimeLine, detail::queue_count> lines_;
    uint64_t fail_creation_ = 0;  ///< counted as in counters_
    uint64_t fail_submit_ = 0;
    ErrorCode fail_code_ = ErrorCode::OutOfMemory;
    uint64_t ids_ = 0;
    bool lost_ = false;
    bool open_ = false;
    std::optional<detail::WindowEvents> window_events_;
    bool window_outdated_ = false;
    bool window_lost_ = false;
    std::function<void(const Error&, bool warning)> message_;
    Observer observer_;
    std::function<void()> presentation_;
    HazardChecker checker_;
};

}  // namespace glint::null
