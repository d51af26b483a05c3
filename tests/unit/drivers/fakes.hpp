#pragma once
// A scripted far end for drivers: time that the test moves, a link that records, a host that
// records.

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "drivers/api/driver.hpp"

namespace weft::testing {

class FakeLoop final : public Loop {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  TimerId at(TimePoint when, Callback callback) override {
    timers_.emplace(std::pair{std::max(when, now_), ++last_}, std::move(callback));
    return last_;
  }
  void cancel(TimerId id) override {
    std::erase_if(timers_, [id](const auto& timer) { return timer.first.second == id; });
  }
  /// Runs what falls due within `seconds`, and moves the clock on by as much.
  void advance(double seconds) {
    const TimePoint end = now_ + from_seconds(seconds);
    while (!timers_.empty() && timers_.begin()->first.first <= end) {
      auto node = timers_.extract(timers_.begin());
      now_ = node.key().first;
      node.mapped()();
    }
    now_ = end;
  }
  [[nodiscard]] std::size_t timers() const { return timers_.size(); }

 private:
  TimePoint now_{};
  TimerId last_ = 0;
  std::map<std::pair<TimePoint, TimerId>, Callback> timers_;
};

class FakeLink final : public Link {
 public:
  Status write(ByteView bytes) override {
    if (broken) return fail(Errc::io, "the port is gone");
    if (record) written_.insert(written_.end(), bytes.begin(), bytes.end());
    return {};
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed closed) override { closed_ = std::move(closed); }

  /// What the driver has written since the last call.
  Bytes take_written() { return std::exchange(written_, {}); }
  void deliver(ByteView bytes, TimePoint arrival) {
    const Receiver receiver = receiver_;
    if (receiver) receiver(bytes, arrival);
  }
  void break_off() {
    broken = true;
    if (const Closed closed = std::exchange(closed_, {}))
      closed(Error{Errc::io, "the cable was pulled", {}, {}, {}, {}});
  }
  [[nodiscard]] bool listened_to() const { return receiver_ || closed_; }

  bool broken = false;
  bool record = true;

 private:
  Bytes written_;
  Receiver receiver_;
  Closed closed_;
};

class FakeHost final : public DriverHost {
 public:
  Loop& loop() override { return loop_; }
  Link& link() override { return link_; }
  void publish(const Sample& sample) override {
    ++published;
    if (!record) return;
    samples.push_back(sample);
    if (const auto* taxels = std::get_if<TaxelSample>(&sample.value))
      taxel_counts.assign(taxels->counts.begin(), taxels->counts.end());
  }
  void identified(const DeviceIdentity& identity) override { identities.push_back(identity); }
  void state_changed(DriverState state) override { states.push_back(state); }
  void fault(const Error& error) override { faults.push_back(error); }
  void log(LogLevel, std::string_view text) override { logs.emplace_back(text); }

  FakeLoop loop_;
  FakeLink link_;
  bool record = true;
  std::size_t published = 0;
  std::vector<Sample> samples;
  std::vector<std::uint16_t> taxel_counts;  ///< of the last sample
  std::vector<DeviceIdentity> identities;
  std::vector<DriverState> states;
  std::vector<Error> faults;
  std::vector<std::string> logs;
};

/// "0A FF 10" to bytes.
inline Bytes hex(const std::string& text) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < text.size(); i += 3)
    out.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return out;
}

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace weft::testing
