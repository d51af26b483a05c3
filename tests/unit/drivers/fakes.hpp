#pragma once
// A scripted far end for drivers: a recording link and a recording host.

#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/api/driver.hpp"
#include "tests/unit/hex.hpp"
#include "tests/unit/test_loop.hpp"

namespace weft::testing {

class FakeLink final : public Link {
 public:
  Status write(ByteView bytes) override {
    if (broken) return fail({.code = Errc::io, .what = "the port is gone"});
    if (record) written_.insert(written_.end(), bytes.begin(), bytes.end());
    return {};
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed closed) override { closed_ = std::move(closed); }

  /// Bytes written by the driver since the last call.
  Bytes take_written() { return std::exchange(written_, {}); }
  void deliver(ByteView bytes, TimePoint arrival) {
    const Receiver receiver = receiver_;
    if (receiver) receiver(bytes, arrival);
  }
  void break_off() {
    broken = true;
    if (const Closed closed = std::exchange(closed_, {}))
      closed(Error{.code = Errc::io, .what = "the cable was pulled"});
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
  Link* http() override { return http_.get(); }
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

  TestLoop loop_;
  FakeLink link_;
  std::unique_ptr<FakeLink> http_;  ///< none initially
  bool record = true;
  std::size_t published = 0;
  std::vector<Sample> samples;
  std::vector<std::uint16_t> taxel_counts;  ///< of the last sample
  std::vector<DeviceIdentity> identities;
  std::vector<DriverState> states;
  std::vector<Error> faults;
  std::vector<std::string> logs;
};

/// A driver and its scripted far end.
struct DriverBench {
  DriverBench(const DriverEntry& entry, const std::string& config) {
    auto made = entry.create(config, host);
    REQUIRE(made);
    driver = std::move(*made);
  }
  void receive(const Bytes& bytes) { host.link_.deliver(bytes, host.loop_.now()); }
  template <class Value>
  const Value& last() const {
    return std::get<Value>(host.samples.back().value);
  }
  /// The only fault, which has stopped the driver.
  const Error& fault() const {
    REQUIRE(host.faults.size() == 1);
    REQUIRE(driver->state() == DriverState::faulted);
    return host.faults[0];
  }
  Errc fault_code() const { return fault().code; }
  /// Checks that after the driver's end no timer and no listener remains.
  void check_gone_without_trace() {
    CHECK(host.loop_.timers() > 0);
    driver.reset();
    CHECK(host.loop_.timers() == 0);
    CHECK_FALSE(host.link_.listened_to());
  }

  FakeHost host;
  std::unique_ptr<Driver> driver;
};

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace weft::testing
