#pragma once
// One stage driver in front of a scripted controller.

#include <catch2/catch.hpp>
#include <string>

#include "drivers/thorlabs_apt/stage_driver.hpp"
#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace weft::testing {

namespace apt = protocols::apt;

constexpr std::uint32_t idle_homed = 0x80000500;
constexpr std::uint32_t idle_not_homed = 0x80000100;
constexpr std::uint32_t moving_homed = 0x80000510;
constexpr std::uint32_t homing = 0x80000300;
constexpr double counts_per_m = 409600e3;  // LTS150

struct StageBench : DriverBench {
  explicit StageBench(const std::string& config)
      : DriverBench(drivers::thorlabs_apt_entry, for_scripts(config)) {}
  /// A test's script jumps between positions and homes without motion.
  static std::string for_scripts(std::string config) {
    if (config.find("check_jumps") != std::string::npos) return config;
    return config.insert(config.find('{') + 1,
                         R"("check_jumps": false, "home_must_move": false, )");
  }
  static StageBench lts(const std::string& more = "") {
    return StageBench(R"({"stage": "LTS150")" + more + "}");
  }
  static StageBench prm(const std::string& more = "") {
    return StageBench(R"({"stage": "PRM1-Z8")" + more + "}");
  }

  using DriverBench::receive;
  void receive(const apt::Message& message) { receive(apt::encode(message)); }
  template <class Body>
  void receive(apt::MessageId id, const Body& body) {
    receive(apt::make_message(id, body, {apt::address::host, apt::address::usb_unit}));
  }
  void receive_info(const char* model, std::uint16_t stage_id = 0) {
    apt::HardwareInfo info;
    info.serial = 45000001;
    info.model = apt::Text<8>::from(model);
    info.stage_id = stage_id;
    receive(apt::MessageId::hw_get_info, info);
  }
  void receive_status(std::int32_t counts, std::uint32_t bits) {
    receive(apt::MessageId::get_statusupdate, apt::StatusUpdate{1, counts, 0, bits});
  }
  void receive_dc_status(std::int32_t counts, std::uint32_t bits) {
    receive(apt::MessageId::get_dcstatusupdate, apt::DcStatusUpdate{1, counts, 0, 0, bits});
  }
  void receive_completed(std::int32_t counts, std::uint32_t bits = idle_homed) {
    receive(apt::MessageId::move_completed, apt::StatusUpdate{1, counts, 0, bits});
  }
  void receive_stopped(std::int32_t counts, std::uint32_t bits = idle_homed) {
    receive(apt::MessageId::move_stopped, apt::StatusUpdate{1, counts, 0, bits});
  }

  /// An LTS150 armed at `counts`, without unread output.
  void arm_lts(std::int32_t counts = 0, std::uint32_t bits = idle_homed) {
    REQUIRE(driver->open());
    receive_info("LTS150");
    REQUIRE(driver->arm());
    receive_status(counts, bits);
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
    link().take_written();
  }
  void arm_prm(std::int32_t counts = 0, std::uint32_t bits = idle_homed) {
    REQUIRE(driver->open());
    receive_info("KDC101", 6);
    REQUIRE(driver->arm());
    receive_dc_status(counts, bits);
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
    link().take_written();
  }

  TestLoop& loop() { return host.loop_; }
  FakeLink& link() { return host.link_; }
  const StageSample& last_sample() const { return last<StageSample>(); }
};

}  // namespace weft::testing
