#pragma once
// A Net F/T box on its own bench, for tests.

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "sim/devices/rdt_emulator.hpp"
#include "tests/unit/sim/support.hpp"

namespace weft::sim::test {

namespace rdt = protocols::rdt;

inline const std::string start = "12 34 00 02 00 00 00 00";  ///< in real time

struct Box {
  explicit Box(RdtEmulatorParams params = {})
      : bench_plant(still_plant(), 1), box(params, bench_plant, 1) {}

  void send(const std::string& text) { box.receive(hex(text), now, sink); }
  void run(double seconds) {
    const TimePoint end = now + from_seconds(seconds);
    for (auto at = box.next_wakeup(); at && *at <= end; at = box.next_wakeup())
      box.wake(now = std::max(*at, now), sink);
    now = end;
  }
  std::vector<rdt::Record> take() {
    std::vector<rdt::Record> records;
    for (const Bytes& datagram : datagrams)
      for (std::size_t at = 0; at + rdt::record_size <= datagram.size(); at += rdt::record_size)
        records.push_back(
            rdt::decode_record(ByteView(datagram).subspan(at, rdt::record_size)).value());
    datagrams.clear();
    return records;
  }

  std::vector<Bytes> datagrams;
  ByteSink sink = [this](ByteView b) { datagrams.emplace_back(b.begin(), b.end()); };
  TimePoint now{};
  BenchPlant bench_plant;
  RdtEmulator box;
};

}  // namespace weft::sim::test
