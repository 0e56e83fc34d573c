#pragma once

/// Decides from measured times whether to rebuild structures or to refit them. Refitting is cheaper, and costs the rays
/// more from frame to frame; what the rays have lost since the last rebuild is summed up, and once it exceeds what a
/// rebuild costs more than a refit, it is time for one. That is at most twice the cost of the best plan made in
/// hindsight, if the loss grows.
class RefitPolicy {
public:
    bool shouldRebuild() const { return !is_waiting_ && (rebuild_ <= 0.0 || lost_ > rebuild_ - refit_); }

    /// The decision for the next frame; times of it may come frames later.
    void decided(bool rebuild) { is_waiting_ = is_waiting_ || rebuild; }

    /// Times of a frame, in order, in any unit.
    void add(bool rebuilt, double build, double trace) {
        if (rebuilt) {
            rebuild_ = build;
            fresh_ = trace;
            lost_ = 0.0;
            is_waiting_ = false;
        } else {
            refit_ = build;
            if (rebuild_ > 0.0 && !is_waiting_) lost_ += trace - fresh_;
        }
    }

private:
    double rebuild_ = 0.0;  ///< 0: not yet known
    double refit_ = 0.0;
    double fresh_ = 0.0;       ///< time to trace what has just been rebuilt
    double lost_ = 0.0;        ///< since then
    bool is_waiting_ = false;  ///< for the times of a rebuild
};
