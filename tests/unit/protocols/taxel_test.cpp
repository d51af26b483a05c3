#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "protocols/taxel/taxel.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace taxel_test {

using namespace weft;
using namespace weft::protocols::taxel;
using weft::testing::check_any_chunking;
using weft::testing::check_bounded;
using weft::testing::check_cut_frame;
using weft::testing::check_flipped_bit;
using weft::testing::hex;
using weft::testing::random_bytes;
using weft::testing::split_in_pieces;
using weft::testing::Vector;

namespace {

Bytes encode(const Frame& frame) {
  Bytes out;
  append(out, frame);
  return out;
}

Frame random_frame(std::mt19937& random) {
  Frame frame;
  frame.sequence = static_cast<std::uint16_t>(random());
  frame.device_us = static_cast<std::uint32_t>(random());
  frame.taxel_count = static_cast<std::uint8_t>(1 + random() % max_taxels);
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    frame.counts[i] = static_cast<std::uint16_t>(random());
  frame.proximity_counts = static_cast<std::uint16_t>(random());
  frame.ambient_counts = static_cast<std::uint16_t>(random());
  return frame;
}

void check_weft(const nlohmann::json& json) {
  const nlohmann::json& f = json.at("fields");
  Frame expected;
  expected.sequence = f.at("sequence");
  expected.device_us = f.at("device_us");
  const auto counts = f.at("counts").get<std::vector<std::uint16_t>>();
  expected.taxel_count = static_cast<std::uint8_t>(counts.size());
  std::copy(counts.begin(), counts.end(), expected.counts.begin());
  expected.proximity_counts = f.at("proximity_counts");
  expected.ambient_counts = f.at("ambient_counts");
  const Bytes bytes = hex(json.at("hex"));
  CHECK(encode(expected) == bytes);
  Splitter splitter;
  splitter.push(bytes);
  Frame frame;
  REQUIRE(splitter.next(frame));
  CHECK(frame == expected);
}

void check_cpm_udp(const nlohmann::json& json) {
  const cpm::Counts counts = json.at("fields").at("counts");
  const Bytes bytes = hex(json.at("hex"));
  CHECK(cpm::decode_datagram(bytes).value() == counts);
  const auto encoded = cpm::encode_datagram(counts);
  CHECK(Bytes(encoded.begin(), encoded.end()) == bytes);
}

void check_cpm_can(const nlohmann::json& json) {
  const nlohmann::json& f = json.at("fields");
  const cpm::Scan expected{f.at("counts"), f.at("proximity1_counts"), f.at("proximity2_counts")};
  const auto frames = cpm::encode_can(expected);
  cpm::CanAssembler assembler;
  std::optional<cpm::Scan> scan;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const nlohmann::json& golden = json.at("can_frames").at(i);
    const Bytes data = hex(golden.at("hex"));
    CHECK(frames[i].id == golden.at("id").get<unsigned>());
    CHECK(Bytes(frames[i].data.begin(), frames[i].data.begin() + frames[i].length) == data);
    CHECK_FALSE(scan);
    scan = assembler.push(frames[i]);
  }
  REQUIRE(scan);
  CHECK(*scan == expected);
}

}  // namespace

TEST_CASE("every taxel vector decodes to its fields and encodes back to its bytes") {
  const std::vector<Vector> vectors = testing::load_vectors("taxel");
  REQUIRE(vectors.size() >= 6);
  for (const Vector& vector : vectors) {
    INFO(vector.name);
    const nlohmann::json golden = nlohmann::json::parse(vector.text);
    REQUIRE_FALSE(golden.at("source").get<std::string>().empty());
    const std::string form = golden.at("fields").at("form");
    if (form == "weft") check_weft(golden);
    if (form == "cpm_udp") check_cpm_udp(golden);
    if (form == "cpm_can") check_cpm_can(golden);
  }
}

TEST_CASE("a frame of 16 taxels is 48 bytes: 28 ms frames fit 115200 baud five times over") {
  Frame frame;
  CHECK(encode(frame).size() == 48);
  CHECK(48 * 10 / 0.028 * 5 < 115200);
}

TEST_CASE("any chunking of a taxel stream gives the same frames") {
  std::mt19937 random(5);
  check_any_chunking<Splitter>(random, random_frame);
}

TEST_CASE("a flipped bit costs one frame, never a wrong one, and the next frames come through") {
  std::mt19937 random(6);
  check_flipped_bit<Splitter>(random, random_frame, frame_size(max_taxels));
}

TEST_CASE("a cut frame is given up for the one behind it") {
  std::mt19937 random(7);
  check_cut_frame<Splitter>(random, random_frame, frame_size(max_taxels));
}

TEST_CASE("noise gives no frames, and the counters show it") {
  std::mt19937 random(8);
  Splitter splitter;
  const Bytes noise = testing::random_bytes(200000, random);
  CHECK(split_in_pieces<Splitter, Frame>(splitter, noise, 1000, random).empty());
  CHECK(splitter.skipped_bytes() > 199000);
}

TEST_CASE("a wrong version or an impossible taxel count is not a frame") {
  Bytes bytes = encode(Frame{});
  for (const auto& [at, value] : {std::pair{2, 2}, {3, 0}, {3, 65}}) {
    Bytes bad = bytes;
    bad[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(value);
    Splitter splitter;
    splitter.push(bad);
    Frame frame;
    CHECK_FALSE(splitter.next(frame));
    CHECK(splitter.damaged() == 0);
  }
}

TEST_CASE("a taxel splitter that is not drained stays bounded") {
  check_bounded<Splitter>(protocols::taxel::sync[0]);
}

TEST_CASE("the wire order of the CPM-Finger reaches every taxel once") {
  std::array<int, cpm::taxels> seen{};
  for (const std::uint8_t taxel : cpm::taxel_at_wire_position) ++seen.at(taxel);
  for (const int times : seen) CHECK(times == 1);
}

TEST_CASE("a CPM datagram of another length is refused") {
  for (const std::size_t size : {0U, 31U, 33U, 64U}) {
    const Result<cpm::Counts> counts = cpm::decode_datagram(Bytes(size, 0));
    CHECK_FALSE(counts);
  }
}

TEST_CASE("a CAN scan with a part missing is dropped and counted, the next one is whole") {
  cpm::Scan scan;
  for (std::size_t i = 0; i < cpm::taxels; ++i) scan.counts[i] = static_cast<std::uint16_t>(i);
  const auto frames = cpm::encode_can(scan);
  for (std::size_t missing = 0; missing < frames.size(); ++missing) {
    cpm::CanAssembler assembler;
    std::vector<cpm::Scan> scans;
    for (int round = 0; round < 2; ++round)
      for (std::size_t i = 0; i < frames.size(); ++i) {
        if (round == 0 && i == missing) continue;
        if (const auto s = assembler.push(frames[i])) scans.push_back(*s);
      }
    CHECK(scans == std::vector<cpm::Scan>{scan});
    CHECK(assembler.incomplete_scans() == 1);
  }
  cpm::CanAssembler assembler;
  CHECK_FALSE(assembler.push(cpm::CanFrame{0x123, 8, {}}));
  CHECK_FALSE(assembler.push(cpm::CanFrame{0x405, 7, {}}));
}

}  // namespace taxel_test
