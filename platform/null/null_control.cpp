#include <platform/null/null_control.h>

#include <platform/null/null_objects.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/object.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace glint::null {

using namespace detail;

namespace {

std::mutex process_mutex;
NullSettings process_settings;
std::shared_ptr<NullControl> process_control;

size_t at(Queue queue) { return static_cast<size_t>(queue); }

HazardResource resolve(const Object* object) {
    const auto* memory = dynamic_cast<const NullMemory*>(object->native.get());
    if (!memory) return {};
    return {memory->life.id(), memory->mips, memory->layers};
}

}  // namespace

ScopedSettings::ScopedSettings(const NullSettings& settings) {
    std::lock_guard lock(process_mutex);
    before_ = std::exchange(process_settings, settings);
}

ScopedSettings::~ScopedSettings() {
    std::lock_guard lock(process_mutex);
    process_settings = before_;
}

NullSettings currentSettings() {
    std::lock_guard lock(process_mutex);
    return process_settings;
}

std::shared_ptr<NullControl> makeControl() {
    std::lock_guard lock(process_mutex);
    process_control = std::make_shared<NullControl>(process_settings);
    return process_control;
}

std::shared_ptr<NullControl> NullControl::last() {
    std::lock_guard lock(process_mutex);
    return process_control;
}

NullControl::NullControl(const NullSettings& settings)
    : settings_(settings),
      fail_creation_(settings.fail_creation),
      fail_submit_(settings.fail_submit),
      fail_code_(settings.fail_code),
      checker_(resolve, [](const Object* object) { return object->label(); }) {}

NullCounters NullControl::counters() const {
    std::lock_guard lock(mutex_);
    return counters_;
}

std::vector<Error> NullControl::findings() const {
    std::lock_guard lock(mutex_);
    return findings_;
}

void NullControl::clearFindings() {
    std::lock_guard lock(mutex_);
    findings_.clear();
}

void NullControl::failCreation(uint64_t n) {
    std::lock_guard lock(mutex_);
    fail_creation_ = n ? counters_.creations + n : 0;
}

void NullControl::failSubmit(uint64_t n, ErrorCode code) {
    std::lock_guard lock(mutex_);
    fail_submit_ = n ? counters_.submits + n : 0;
    fail_code_ = code;
}

void NullControl::hold(Queue queue) {
    std::lock_guard lock(mutex_);
    TimeLine& line = lines_[at(queue)];
    line.held = true;
    line.released = line.completed;
}

void NullControl::release(Queue queue) {
    std::lock_guard lock(mutex_);
    lines_[at(queue)].held = false;
    progress();
}

void NullControl::release(Queue queue, uint64_t value) {
    std::lock_guard lock(mutex_);
    TimeLine& line = lines_[at(queue)];
    line.released = std::max(line.released, value);
    progress();
}

void NullControl::setWindowEvents(const WindowEvents& events) {
    std::lock_guard lock(mutex_);
    window_events_ = events;
}

void NullControl::outdateWindow() {
    std::lock_guard lock(mutex_);
    window_outdated_ = true;
}

void NullControl::loseWindow() {
    std::lock_guard lock(mutex_);
    window_lost_ = true;
}

WindowEvents NullControl::takeWindowEvents(const WindowEvents& before) {
    std::lock_guard lock(mutex_);
    WindowEvents events = window_events_.value_or(before);
    if (window_events_) {
        window_events_->close = false;
        window_events_->pressed_buttons.reset();
        window_events_->pressed_keys.reset();
        window_events_->wheel = {0, 0};
        window_events_->text.clear();
    }
    return events;
}

bool NullControl::takeOutdated() {
    std::lock_guard lock(mutex_);
    return std::exchange(window_outdated_, false);
}

bool NullControl::isWindowLost() const {
    std::lock_guard lock(mutex_);
    return window_lost_;
}

void NullControl::setPresentation(std::function<void()> presentation) {
    std::lock_guard lock(mutex_);
    presentation_ = std::move(presentation);
}

void NullControl::present() const {
    std::function<void()> presentation;
    {
        std::lock_guard lock(mutex_);
        presentation = presentation_;
    }
    if (presentation) presentation();
}

void NullControl::setObserver(Observer observer) {
    std::lock_guard lock(mutex_);
    observer_ = std::move(observer);
}

Status NullControl::create(uint64_t bytes) {
    std::lock_guard lock(mutex_);
    counters_.creations++;
    if (counters_.creations == fail_creation_) {
        return makeError(ErrorCode::OutOfMemory, "device.out_of_memory", "creation {} fails on request",
                         counters_.creations);
    }
    if (bytes > settings_.memory || counters_.bytes > settings_.memory - bytes) {
        return makeError(ErrorCode::OutOfMemory, "device.out_of_memory", "{} bytes: {} of {} bytes are in use", bytes,
                         counters_.bytes, settings_.memory);
    }
    counters_.objects++;
    counters_.bytes += bytes;
    return {};
}

void NullControl::destroy(uint64_t id, uint64_t bytes, const std::string& name,
                          const std::array<uint64_t, queue_count>& last_use) {
    std::vector<Error> found;
    {
        std::lock_guard lock(mutex_);
        counters_.objects--;
        counters_.bytes -= bytes;
        checker_.forget(id);
        for (size_t q = 0; q < queue_count; q++) {
            if (last_use[q] <= lines_[q].completed || lost_) continue;
            found.push_back(makeError(ErrorCode::Internal, "null.destroyed_in_use",
                                      "'{}' was deleted before submission {} of queue {} was done, which uses it", name,
                                      last_use[q], q));
        }
        if (!open_) {
            found.push_back(
                makeError(ErrorCode::Internal, "null.outlived", "'{}' was deleted after its back end", name));
        }
    }
    tell(std::move(found));
}

uint64_t NullControl::nextId() {
    std::lock_guard lock(mutex_);
    return ++ids_;
}

Status NullControl::beginSubmit(const Submission& submission) {
    std::lock_guard lock(mutex_);
    counters_.submits++;
    if (counters_.submits == fail_submit_) {
        if (fail_code_ != ErrorCode::DeviceLost) {
            return makeError(ErrorCode::OutOfMemory, "device.out_of_memory", "submission {} fails on request",
                             counters_.submits);
        }
        // Nothing runs on a lost device, so nothing is in use any more either.
        lost_ = true;
        for (TimeLine& line : lines_) {
            line.completed = line.submitted;
            line.pending.clear();
        }
        progressed_.notify_all();
    }
    if (lost_) return makeError(ErrorCode::DeviceLost, "device.lost", "the device was lost on request");

    const auto refuse = [&](const char* what, Queue queue, uint64_t value) {
        return makeError(ErrorCode::Internal, "null.value", "{} {} of queue {}, whose last value is {}", what, value,
                         at(queue), lines_[at(queue)].submitted);
    };
    if (submission.queue != Queue::Main && !settings_.queues[at(submission.queue)])
        return makeError(ErrorCode::Internal, "null.value", "there is no queue {}", at(submission.queue));
    if (submission.value <= lines_[at(submission.queue)].submitted)
        return refuse("a submission with value", submission.queue, submission.value);
    for (const TimelinePoint& point : submission.waits)
        if (point.value > lines_[at(point.queue)].submitted)
            return refuse("a wait for value", point.queue, point.value);
    return {};
}

void NullControl::count(const NullCounters& more) {
    std::lock_guard lock(mutex_);
    counters_.waits += more.waits;
    counters_.lists += more.lists;
    counters_.commands += more.commands;
    counters_.dispatches += more.dispatches;
    counters_.draws += more.draws;
    counters_.builds += more.builds;
    counters_.barriers += more.barriers;
    counters_.image_barriers += more.image_barriers;
    counters_.splits += more.splits;
}

void NullControl::judge(const Submission& submission) {
    std::vector<Error> found;
    {
        std::lock_guard lock(mutex_);
        if (observer_) observer_(submission, checker_);
        if (settings_.judge) found = checker_.judge(submission);
    }
    tell(std::move(found));
}

void NullControl::report(Error finding) { tell({std::move(finding)}); }

void NullControl::endSubmit(const Submission& submission) {
    std::lock_guard lock(mutex_);
    TimeLine& line = lines_[at(submission.queue)];
    line.submitted = submission.value;
    line.pending.push_back({submission.value, {submission.waits.begin(), submission.waits.end()}});
    progress();
}

uint64_t NullControl::completed(Queue queue) const {
    std::lock_guard lock(mutex_);
    return lines_[at(queue)].completed;
}

Status NullControl::wait(std::span<const TimelinePoint> points, uint64_t nanoseconds) {
    std::unique_lock lock(mutex_);
    const auto done = [&] {
        return lost_ || std::ranges::all_of(points, [&](const TimelinePoint& point) {
                   return lines_[at(point.queue)].completed >= point.value;
               });
    };
    // A deadline that far away overflows the clock.
    constexpr uint64_t forever = 1ull << 60;
    if (nanoseconds >= forever) {
        progressed_.wait(lock, done);
    } else if (!progressed_.wait_for(lock, std::chrono::nanoseconds(nanoseconds), done)) {
        return makeError(ErrorCode::InvalidArgument, "fence.timeout", "not done after {} ns", nanoseconds);
    }
    if (lost_) return makeError(ErrorCode::DeviceLost, "device.lost", "the device was lost on request");
    return {};
}

void NullControl::open(std::function<void(const Error&, bool warning)> message) {
    std::lock_guard lock(mutex_);
    open_ = true;
    message_ = std::move(message);
}

void NullControl::close() {
    std::lock_guard lock(mutex_);
    open_ = false;
    message_ = {};
    observer_ = {};
}

// One queue's progress may be what another waits for.
void NullControl::progress() {
    const auto passed = [&](const TimelinePoint& point) { return lines_[at(point.queue)].completed >= point.value; };
    for (bool moved = true; moved;) {
        moved = false;
        for (TimeLine& line : lines_) {
            while (!line.pending.empty()) {
                const Pending& next = line.pending.front();
                if (line.held && next.value > line.released) break;
                if (!std::ranges::all_of(next.waits, passed)) break;
                line.completed = next.value;
                line.pending.pop_front();
                moved = true;
            }
        }
    }
    progressed_.notify_all();
}

// The callback may come from anywhere and do anything but call the device, so it is called without the lock.
void NullControl::tell(std::vector<Error> found) {
    if (found.empty()) return;
    std::function<void(const Error&, bool)> message;
    {
        std::lock_guard lock(mutex_);
        findings_.insert(findings_.end(), found.begin(), found.end());
        message = message_;
    }
    if (!message) return;
    for (const Error& finding : found) message(finding, false);
}

}  // namespace glint::null
