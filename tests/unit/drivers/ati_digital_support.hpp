#pragma once
// A Digital F/T sensor that answers from its registers, and a host for its driver.

#include <algorithm>
#include <catch2/catch.hpp>

#include "drivers/ati_digital/digital_driver.hpp"
#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "protocols/modbus/rtu.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace weft::testing {

using namespace protocols::modbus;
using namespace protocols::ati_digital;

inline const Bytes jam(72, 0);
inline const Bytes read_status = hex("0A 03 00 1D 00 01 15 77");
inline const Bytes unlock_request = hex("0A 6A AA FF 1D");
inline const Bytes lock_request = hex("0A 6A 18 7F 68");
inline const Bytes start_request = hex("0A 46 55 A3 9D");
inline const Bytes started = hex("0A 46 01 A2 62");

inline Calibration calibration() {
  Calibration c;
  c.serial = "FT12288";
  c.part_number = "SI-40-2";
  c.family = "DFT";
  c.time = "2019/05/07";
  for (std::size_t i = 0; i < 6; ++i) c.matrix[i][i] = 1000;  // 1 mN or 1 mN m a count
  c.max_rating = {40, 40, 120, 2, 2, 2};
  c.counts_per_force = c.counts_per_torque = 1000000;
  c.gain = {543, 555, 569, 579, 565, 567};
  c.offset = {1, 2, 3, 4, 5, 6};
  return c;
}

/// A sensor that answers from its registers, and a host for the driver.
struct DigitalBench : DriverBench {
  explicit DigitalBench(const std::string& config = "{}")
      : DriverBench(drivers::ati_digital_entry, config) {}
  void reply(const Reply& reply) {
    Bytes bytes;
    append_rtu(bytes, 10, reply);
    receive(bytes);
  }
  void quiet() { host.loop_.run_for(0.051); }

  Reply answer(const Request& request) {
    if (const auto* read = std::get_if<Read>(&request)) {
      const auto record = encode(held);
      ReadReply reply{read->function, {}};
      reply.registers.count = static_cast<std::uint8_t>(read->count);
      for (std::size_t i = 0; i < read->count; ++i) {
        const std::size_t at = read->address + i;
        std::uint16_t& value = reply.registers.values[i];
        if (at < 6)
          value = active_gain[at];
        else if (at < 12)
          value = active_offset[at - 6];
        else if (at == holding::status)
          value = status_word;
        else if (at >= first)
          value = record.at(at - first);
      }
      return reply;
    }
    if (const auto* write = std::get_if<WriteMany>(&request)) {
      auto& target = write->address == 0 ? active_gain : active_offset;
      if (takes_writes) std::copy_n(write->registers.values.begin(), 6, target.begin());
      return WroteMany{write->address, write->registers.count};
    }
    return Vendor{std::get<Vendor>(request).function, 1};
  }
  /// Answers the driver's requests until it writes nothing further. Returns all that it wrote.
  Bytes serve() {
    Bytes all;
    RtuSplitter splitter(Side::requests, 10);
    for (Bytes written = host.link_.take_written(); !written.empty();
         written = host.link_.take_written()) {
      all = all + written;
      splitter.push(written);
      while (const auto pdu = splitter.next()) reply(answer(decode_request(*pdu).value()));
    }
    return all;
  }
  Bytes open() {
    REQUIRE(driver->open());
    CHECK(host.link_.take_written() == jam);
    quiet();
    return serve();
  }
  void stream(const std::array<std::int16_t, 6>& counts, bool error = false) {
    Bytes bytes;
    append(bytes, StreamRecord{counts, error});
    receive(bytes);
  }
  void arm() {
    open();
    REQUIRE(driver->state() == DriverState::open);
    REQUIRE(driver->arm());
    CHECK(host.link_.take_written() == start_request);
    receive(started);
    stream({});
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
  }
  const WrenchSample& last() const { return DriverBench::last<WrenchSample>(); }
  const Error& fault() const {
    CHECK(host.loop_.timers() == 0);
    return DriverBench::fault();
  }

  static constexpr std::uint16_t first = holding::first_calibration;
  Calibration held = calibration();
  std::array<std::uint16_t, 6> active_gain{}, active_offset{};
  std::uint16_t status_word = 0;
  bool takes_writes = true;
};

inline std::size_t position(const Bytes& in, const Bytes& what) {
  return static_cast<std::size_t>(std::search(in.begin(), in.end(), what.begin(), what.end()) -
                                  in.begin());
}

}  // namespace weft::testing
