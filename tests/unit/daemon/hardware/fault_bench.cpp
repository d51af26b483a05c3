#include "tests/unit/daemon/hardware/fault_bench.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "drivers/ati_digital/digital_driver.hpp"
#include "drivers/ati_netft/netft_driver.hpp"
#include "drivers/imprint_array/imprint_driver.hpp"
#include "drivers/taxel_array/taxel_driver.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"
#include "drivers/vibro/vibro_driver.hpp"
#include "tests/unit/source_text.hpp"

namespace weft::testing {
namespace {

using nlohmann::json;

constexpr Duration cycle_period = std::chrono::milliseconds(10);
constexpr double near_mm = 1, far_mm = 4, speed_mm_s = 4;

/// The device of bench17, with the parts of its configuration that the table uses.
json device_of(const json& rig, const std::string& device) {
  if (device.starts_with("vibro"))
    return {
        {"name", "vibro"},
        {"config", json::object()},
        {"emulator", {{"kind", "vibro"}, {"form", device == "vibro_udp" ? "datagram" : "stream"}}}};
  if (device == "imprint")
    return {{"name", "imprint"},
            {"config", {{"rows", 32}, {"cols", 32}, {"rate_hz", 20}}},
            {"emulator", {{"kind", "imprint"}, {"rate_hz", 20}}}};
  if (device.starts_with("digital")) {
    const int records = device == "digital_mean" ? 10 : 1;
    return {{"name", "ft"},
            {"config", {{"rate_hz", 100}, {"average", records}, {"calibration_serial", "FT40001"}}},
            {"emulator", {{"kind", "ati_digital"}, {"rate_hz", 100 * records}}}};
  }
  const bool stage = device.starts_with("lts") || device == "prm";
  const std::size_t index = device == "prm" ? 3 : stage ? 2 : device.starts_with("ft") ? 5 : 6;
  json entry = rig["devices"][index];
  if (stage) entry["config"]["serial"] = entry["emulator"]["serial"];
  if (device == "lts_encoder") entry["config"]["encoder"] = entry["emulator"]["encoder"] = true;
  if (device == "cpm") entry["config"]["form"] = entry["emulator"]["form"] = "cpm_udp";
  return entry;
}

}  // namespace

FaultBench::FaultBench(const std::string& device) {
  json rig = json::parse(source_text("sim/rigs/bench17.json"));
  const json entry = device_of(rig, device);
  rig["devices"] = json::array({entry});
  rig["simulation"].erase("traits");  // physics above level L0 is not needed
  // An imprint array presses on objects with a face.
  const char* const table = device == "imprint" ? "sim/objects.json" : "sim/fabrics.json";
  auto made = sim::Rig::create(rig.dump(), source_text(table), 5);
  if (!made) FAIL(to_string(made.error()));
  rig_ = std::move(*made);
  name_ = entry["name"];
  stage_ = device.starts_with("lts") || device == "prm";
  unit_ = device == "prm" ? std::numbers::pi / 180 : 1e-3;
  constexpr Duration latency = std::chrono::milliseconds(1);
  std::tie(host_end_, device_end_) = daemon::MemoryLink::make_pair(loop_, loop_, latency);
  REQUIRE(rig_->attach(name_, *device_end_, loop_));
  if (device == "ft_page") {
    std::tie(page_end_, far_page_end_) = daemon::MemoryLink::make_pair(loop_, loop_, latency);
    REQUIRE(rig_->attach_page(name_, *far_page_end_, loop_));
  }
  const auto& plugin = stage_                        ? drivers::thorlabs_apt_entry
                       : device.starts_with("ft")    ? drivers::ati_netft_entry
                       : device.starts_with("vibro") ? drivers::vibro_entry
                       : device.starts_with("dig")   ? drivers::ati_digital_entry
                       : device == "imprint"         ? drivers::imprint_array_entry
                                                     : drivers::taxel_array_entry;
  auto driver = plugin.create(entry["config"].dump(), *this);
  if (!driver) FAIL(to_string(driver.error()));
  driver_ = std::move(*driver);
}

FaultBench::~FaultBench() {
  driver_->close();
  driver_.reset();
}

bool FaultBench::until(const std::function<bool()>& done, double limit_s) {
  const TimePoint end = loop_.now() + from_seconds(limit_s);
  while (!done() && faults.empty() && loop_.now() < end) loop_.run_to(loop_.now() + cycle_period);
  return done() && faults.empty();
}

bool FaultBench::ready() {
  static_cast<void>(driver_->open());
  if (!until([&] { return driver_->state() == DriverState::open; }, 3)) return false;
  static_cast<void>(driver_->arm());
  if (!until([&] { return driver_->state() == DriverState::armed; }, 3)) return false;
  if (!stage_) return true;
  const auto home = driver_->command(HomeCommand{});
  REQUIRE(home);
  return until([&] { return last_stage_.move_id == *home; }, 200);
}

void FaultBench::next_move() {
  const double target = forth_ ? far_mm : near_mm;
  const auto sent = driver_->command(MoveCommand{target * unit_, speed_mm_s * unit_});
  if (!sent) return;
  forth_ = !forth_;
  move_ = *sent;
}

void FaultBench::cycle() {
  if (!stage_ || driver_->state() != DriverState::armed) return;
  static_cast<void>(driver_->command(PollCommand{}));
  if (driver_->state() != DriverState::armed) return;
  if (move_ != 0 && last_stage_.move_id == move_) {
    ++moves_done;
    move_ = 0;
  }
  if (move_ == 0) next_move();
}

void FaultBench::work(double seconds) {
  const TimePoint end = loop_.now() + from_seconds(seconds);
  while (loop_.now() < end && faults.empty()) {
    cycle();
    loop_.run_to(loop_.now() + cycle_period);
  }
}

void FaultBench::inject(const std::string& fault, const std::string& more) {
  json order = json::parse("{" + more + "}");
  order["device"] = name_;
  order["fault"] = fault;
  const Status put = rig_->inject(order.dump(), loop_.now());
  if (!put) FAIL(to_string(put.error()));
}

void FaultBench::publish(const Sample& sample) {
  Seen seen{sample.host, sample.sequence, sample.lost, true, sample.value.index(), 0};
  const auto take_block = [&](std::span<const double> values, std::uint32_t clipped) {
    seen.valid = clipped == 0;
    for (const double value : values) seen.value += value / static_cast<double>(values.size());
  };
  if (const auto* stage = std::get_if<StageSample>(&sample.value)) {
    last_stage_ = *stage;
    seen.value = stage->position / unit_;
  } else if (const auto* wrench = std::get_if<WrenchSample>(&sample.value)) {
    seen.valid = wrench->valid;
    seen.value = wrench->force_n[2];
  } else if (const auto* taxels = std::get_if<TaxelSample>(&sample.value)) {
    for (const std::uint16_t counts : taxels->counts) seen.value += counts;
    seen.value /= static_cast<double>(taxels->counts.size());
  } else if (const auto* shaken = std::get_if<AccelerationSample>(&sample.value)) {
    take_block(shaken->acceleration_mps2, shaken->clipped);
  } else if (const auto* received = std::get_if<SoundSample>(&sample.value)) {
    take_block(received->pressure_pa, received->clipped);
  }
  samples.push_back(seen);
}

void FaultBench::fault(const Error& error) {
  faults.push_back(error);
  fault_times_s.push_back(now_s());
}

}  // namespace weft::testing
