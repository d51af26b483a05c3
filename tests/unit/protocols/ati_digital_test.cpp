#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace ati_digital_test {

using namespace weft;
using namespace weft::protocols::ati_digital;
using weft::testing::hex;

namespace {

/// A load that changes slowly, with a little noise, like that of a sensor.
StreamRecord wandering(int i, std::mt19937& random) {
  StreamRecord record;
  for (std::size_t g = 0; g < gauges; ++g)
    record.gauge_counts[g] = static_cast<std::int16_t>(
        3000 * std::sin(0.01 * i + static_cast<double>(g)) + static_cast<double>(random() % 7));
  return record;
}

struct Stream {
  Bytes bytes;
  std::vector<StreamRecord> records;
};

Stream make_stream(int count, std::mt19937& random) {
  Stream s;
  for (int i = 0; i < count; ++i) {
    s.records.push_back(wandering(i, random));
    append(s.bytes, s.records.back());
  }
  return s;
}

struct Split {
  std::vector<StreamRecord> records;
  std::vector<std::uint32_t> lost;
  [[nodiscard]] std::uint32_t total_lost() const {
    std::uint32_t sum = 0;
    for (const std::uint32_t n : lost) sum += n;
    return sum;
  }
};

Split split(StreamSplitter& splitter, ByteView stream, std::size_t longest, std::mt19937& random) {
  Split out;
  StreamRecord record;
  std::uint32_t lost = 0;
  while (!stream.empty()) {
    const std::size_t piece = std::min<std::size_t>(1 + random() % longest, stream.size());
    splitter.push(stream.first(piece));
    stream = stream.subspan(piece);
    while (splitter.next(record, lost)) {
      out.records.push_back(record);
      out.lost.push_back(lost);
    }
  }
  return out;
}

Calibration example() {
  Calibration c;
  c.serial = "FT12288";
  c.part_number = "SI-80-4";
  c.family = "DigF";
  c.time = "2019/05/07";
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t g = 0; g < gauges; ++g)
      c.matrix[i][g] = static_cast<float>(10 * i) + 0.25F * static_cast<float>(g) - 7;
  c.max_rating = {80, 80, 240, 4, 4, 4};
  c.counts_per_force = 1000000;
  c.counts_per_torque = 2000000;
  c.gain = {543, 555, 569, 579, 565, 567};
  c.offset = {32000, 33000, 34000, 35000, 32500, 33500};
  return c;
}

std::string refusal(const Calibration& c) {
  const auto matrix = gauge_matrix(c);
  REQUIRE_FALSE(matrix);
  CHECK(matrix.error().code == Errc::range);
  return matrix.error().what;
}

}  // namespace

TEST_CASE("every stream vector decodes to its gauges and encodes back to its bytes") {
  const auto vectors = testing::load_vectors("ati_digital");
  REQUIRE_FALSE(vectors.empty());
  for (const auto& vector : vectors) {
    const auto golden = nlohmann::json::parse(vector.text);
    const StreamRecord expected{golden.at("fields").at("gauge_counts"),
                                golden.at("fields").at("status_error")};
    const Bytes bytes = hex(golden.at("hex"));
    CHECK(decode_record(bytes).value() == expected);
    Bytes encoded;
    append(encoded, expected);
    CHECK(encoded == bytes);
  }
}

TEST_CASE("the status error is bit 7 of the last byte and no part of the sum") {
  Bytes bytes = hex("00 64 01 2C 01 F4 FF 38 FE 70 FD A8 D0");
  CHECK(decode_record(bytes)->status_error);
  bytes[12] ^= 1;
  CHECK_FALSE(decode_record(bytes));
  CHECK_FALSE(decode_record(ByteView(bytes).first(12)));
}

TEST_CASE("any chunking of a stream gives the same records, in step or found") {
  std::mt19937 random(1);
  const Stream stream = make_stream(300, random);
  for (const std::size_t longest : {1U, 5U, 13U, 200U, 4000U})
    for (const bool in_step : {true, false}) {
      StreamSplitter splitter;
      in_step ? splitter.begin_in_step() : splitter.begin_anywhere();
      const Split got = split(splitter, stream.bytes, longest, random);
      // A phase needs four more records to be certain, and five are examined.
      REQUIRE(got.records.size() >= 300 - (in_step ? 0 : StreamSplitter::records_to_agree));
      CHECK(std::equal(got.records.begin(), got.records.end(), stream.records.begin()));
      CHECK(splitter.dropped_bytes() == 0);
      CHECK(got.total_lost() == 0);
    }
}

TEST_CASE("a damaged record is counted as lost, and the next ones come through") {
  std::mt19937 random(2);
  for (int round = 0; round < 300; ++round) {
    Stream stream = make_stream(60, random);
    const std::size_t at = 20 * record_size + random() % record_size;
    stream.bytes[at] ^= static_cast<std::uint8_t>(1U << random() % 7);  // bit 7 is not in the sum
    StreamSplitter splitter;
    splitter.begin_in_step();
    const Split got = split(splitter, stream.bytes, 40, random);
    stream.records.erase(stream.records.begin() + 20);
    CHECK(got.records == stream.records);
    CHECK(got.lost.at(20) == 1);
    CHECK(got.total_lost() == 1);
    CHECK(splitter.resynchronisations() == 1);
  }
}

TEST_CASE("one damaged record among four costs that one and no wait for more, at any load") {
  std::mt19937 random(6);
  for (const bool still : {true, false}) {
    Stream stream = make_stream(60, random);
    if (still) stream = {};
    for (int i = 0; still && i < 60; ++i) {
      stream.records.push_back({{3, -2, 0, 1, -1, 2}, false});
      append(stream.bytes, stream.records.back());
    }
    for (const std::size_t damaged : {20U, 24U, 28U}) stream.bytes[damaged * record_size + 3] ^= 4;
    StreamSplitter splitter;
    splitter.begin_in_step();
    const ByteView until_third(stream.bytes.data(), 32 * record_size);
    const Split got = split(splitter, Bytes(until_third.begin(), until_third.end()), 40, random);
    CHECK(got.records.size() == 29);
    CHECK(got.total_lost() == 3);
  }
}

TEST_CASE("after garbage of any length or missing bytes the frame is found again") {
  std::mt19937 random(3);
  int wrong = 0;
  for (int round = 0; round < 500; ++round) {
    const Stream stream = make_stream(80, random);
    const std::size_t cut = 20 * record_size + random() % record_size;
    const std::size_t missing = random() % 30;
    Bytes bytes(stream.bytes.begin(), stream.bytes.begin() + static_cast<std::ptrdiff_t>(cut));
    const Bytes garbage = testing::random_bytes(random() % 200, random);
    bytes.insert(bytes.end(), garbage.begin(), garbage.end());
    bytes.insert(bytes.end(), stream.bytes.begin() + static_cast<std::ptrdiff_t>(cut + missing),
                 stream.bytes.end());
    StreamSplitter splitter;
    splitter.begin_in_step();
    const Split got = split(splitter, bytes, 100, random);
    // The end is the complete stream again.
    REQUIRE(got.records.size() >= 70);
    CHECK(std::equal(got.records.end() - 50, got.records.end(), stream.records.end() - 50));
    for (const StreamRecord& r : got.records)
      wrong += std::find(stream.records.begin(), stream.records.end(), r) == stream.records.end();
  }
  // One random record in 128 has a correct sum, at most one per loss of step.
  CHECK(wrong < 500 * 3 / 128 + 10);
}

TEST_CASE("a load that does not change at all is found at the phase of the last good record") {
  std::mt19937 random(4);
  for (int round = 0; round < 200; ++round) {
    StreamRecord record;
    for (std::int16_t& counts : record.gauge_counts) counts = static_cast<std::int16_t>(random());
    Bytes bytes;
    for (int i = 0; i < 60; ++i) append(bytes, record);
    const auto hole = bytes.begin() + static_cast<std::ptrdiff_t>(100 + random() % 100);
    bytes.erase(hole, hole + static_cast<std::ptrdiff_t>(1 + random() % 12));
    StreamSplitter splitter;
    splitter.begin_in_step();
    const Split got = split(splitter, bytes, 300, random);
    REQUIRE(got.records.size() > 35);
    // A record that begins with the gap may have a correct sum by chance.
    CHECK(std::count(got.records.begin(), got.records.end(), record) >=
          static_cast<std::ptrdiff_t>(got.records.size()) - 1);
  }
}

TEST_CASE("noise gives hardly a record, and a splitter that is not drained stays bounded") {
  std::mt19937 random(5);
  StreamSplitter splitter;
  splitter.begin_anywhere();
  const Bytes noise = testing::random_bytes(200000, random);
  // Four sums in a row are correct by chance once in 2^28 places.
  CHECK(split(splitter, noise, 1000, random).records.empty());
  CHECK(splitter.dropped_bytes() > 199000);
  StreamSplitter full;
  full.begin_in_step();
  full.push(Bytes(StreamSplitter::capacity + 77, 0x55));
  CHECK(full.dropped_bytes() == 77);
}

// device-facts.md, ATI Digital F/T: big-endian, high word first
TEST_CASE("a calibration is in its registers where the document puts it") {
  const CalibrationRegisters r = encode(example());
  CHECK(r[0] == ('F' << 8 | 'T'));
  CHECK(r[3] == ('8' << 8));
  CHECK(r[4] == ('S' << 8 | 'I'));
  CHECK(r[20] == ('D' << 8 | 'i'));
  CHECK(r[22] == ('2' << 8 | '0'));
  CHECK(r[32] == 0xC0E0);  // -7.0F = C0E00000
  CHECK(r[33] == 0);
  CHECK(r[32 + 12] == 0x4040);  // row 1, gauge 0: 3.0F = 40400000
  CHECK(r[104] == 0x0203);      // N, N-m
  CHECK(r[105] == 0x42A0);      // 80.0F
  CHECK(r[117] == 0x000F);      // 1000000
  CHECK(r[118] == 0x4240);
  CHECK(r[119] == 0x001E);  // 2000000
  CHECK(r[120] == 0x8480);
  CHECK(r[121] == 543);
  CHECK(r[127] == 32000);
  CHECK(r[133] == 0);
  CHECK(decode_calibration(r).value() == example());
  CHECK_FALSE(decode_calibration(std::span(r).first(167)));
}

TEST_CASE("the addresses of the calibrations and the pieces in which they are read") {
  CHECK(calibration_address(1) == 0x00E3);
  CHECK(calibration_address(2) == 0x01A3);
  CHECK(calibration_address(16) == 0x0C23);
  CHECK(calibration_pieces[0] + calibration_pieces[1] + calibration_pieces[2] ==
        calibration_registers);
}

TEST_CASE("the gauge matrix gives newtons whatever unit the sensor was calibrated in") {
  Calibration c = example();
  const std::array<double, 6> counts{100, -200, 300, -400, 500, -600};
  const auto in_newtons = gauge_matrix(c).value().wrench(counts);
  double expected = 0;
  for (std::size_t g = 0; g < gauges; ++g) expected += double{c.matrix[2][g]} * counts[g] / 1e6;
  CHECK(in_newtons[2] == Approx(expected).epsilon(1e-12));
  CHECK(gauge_matrix(c)->rating[2] == Approx(240));
  const std::array<double, 7> newton{0,    4.4482216152605, 1,         4448.2216152605,
                                     1000, 9.80665,         9.80665e-3};
  const std::array<double, 7> newton_metre{
      0, 0.1129848290276167, 1.3558179483314004, 1, 1e-3, 0.0980665, 1000};
  for (std::uint8_t unit = 1; unit <= 6; ++unit) {
    c.force_unit = c.torque_unit = unit;
    const auto matrix = gauge_matrix(c).value();
    CHECK(matrix.wrench(counts)[2] == Approx(in_newtons[2] * newton[unit]).epsilon(1e-9));
    CHECK(matrix.wrench(counts)[4] == Approx(in_newtons[4] * newton_metre[unit]).epsilon(1e-9));
    CHECK(matrix.rating[0] == Approx(80 * newton[unit]).epsilon(1e-6));
  }
}

TEST_CASE("a calibration that would make nonsense of forces is refused") {
  const auto with = [](auto change) {
    Calibration c = example();
    change(c);
    return refusal(c);
  };
  CHECK(refusal(Calibration{}).find("row") != std::string::npos);  // an empty slot
  CHECK(with([](Calibration& c) { c.force_unit = 7; }).find("unit") != std::string::npos);
  CHECK(with([](Calibration& c) { c.torque_unit = 0; }).find("unit") != std::string::npos);
  CHECK(with([](Calibration& c) { c.counts_per_force = 0; }).find("scale") != std::string::npos);
  CHECK(with([](Calibration& c) { c.counts_per_torque = -5; }).find("scale") != std::string::npos);
  CHECK(with([](Calibration& c) { c.matrix[3].fill(0); }).find("row") != std::string::npos);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(with([&](Calibration& c) { c.matrix[5][5] = nan; }).find("row") != std::string::npos);
  CHECK(with([&](Calibration& c) { c.max_rating[1] = nan; }).find("rating") != std::string::npos);
  CHECK(with([&](Calibration& c) { c.max_rating[1] = 0; }).find("rating") != std::string::npos);
}

TEST_CASE("random registers never make a calibration that is not finite") {
  std::mt19937 random(6);
  for (int i = 0; i < 3000; ++i) {
    CalibrationRegisters registers{};
    for (std::uint16_t& r : registers) r = static_cast<std::uint16_t>(random());
    const auto calibration = decode_calibration(registers);
    REQUIRE(calibration);
    if (const auto matrix = gauge_matrix(*calibration))
      for (const double v : matrix->wrench({1, 1, 1, 1, 1, 1})) CHECK(std::isfinite(v));
  }
}

TEST_CASE("the status word has a text") {
  CHECK(status_text(0).empty());
  CHECK(status_text(1U << 2 | 1U << 7) == "excitation voltage low, EEPROM");
}

}  // namespace ati_digital_test
