#include <catch2/catch.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocols/rdt/rdt.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace rdt_test {

using namespace weft;
using namespace weft::protocols::rdt;
using weft::testing::hex;
using weft::testing::Vector;

namespace {

void check_record(const nlohmann::json& f, const Bytes& bytes) {
  const Record expected{f.at("rdt_sequence"), f.at("ft_sequence"), f.at("status"),
                        f.at("force_counts"), f.at("torque_counts")};
  CHECK(decode_record(bytes).value() == expected);
  Bytes encoded;
  append(encoded, expected);
  CHECK(encoded == bytes);
}

void check_request(const nlohmann::json& f, const Bytes& bytes) {
  const Request expected{static_cast<RequestCommand>(f.at("command").get<std::uint16_t>()),
                         f.at("sample_count")};
  CHECK(decode_request(bytes).value() == expected);
  const auto encoded = encode(expected);
  CHECK(Bytes(encoded.begin(), encoded.end()) == bytes);
}

}  // namespace

TEST_CASE("every RDT vector decodes to its fields and encodes back to its bytes") {
  const std::vector<Vector> vectors = testing::load_vectors("rdt");
  REQUIRE(vectors.size() >= 5);
  for (const Vector& vector : vectors) {
    INFO(vector.name);
    const nlohmann::json golden = nlohmann::json::parse(vector.text);
    REQUIRE_FALSE(golden.at("source").get<std::string>().empty());
    if (golden.contains("message")) continue;  // for the command port: tcp_command_test.cpp
    const Bytes bytes = hex(golden.at("hex"));
    if (bytes.size() == request_size)
      check_request(golden.at("fields"), bytes);
    else
      check_record(golden.at("fields"), bytes);
  }
}

TEST_CASE("a record of 35 or 37 bytes is refused, and so is none at all") {
  for (const std::size_t size : {0U, 1U, 35U, 37U, 72U})
    CHECK(decode_record(Bytes(size, 0)).error().code == Errc::parse);
  CHECK(decode_record(Bytes(36, 0)));
}

TEST_CASE("records survive the wire at the bounds of their integers") {
  constexpr auto lowest = std::numeric_limits<std::int32_t>::min();
  constexpr auto highest = std::numeric_limits<std::int32_t>::max();
  const Record record{0xFFFFFFFF, 0, 0x80010000, {lowest, highest, -1}, {highest, 0, lowest}};
  Bytes bytes;
  append(bytes, record);
  CHECK(bytes.size() == record_size);
  CHECK(decode_record(bytes).value() == record);
}

TEST_CASE("random records and requests survive the wire") {
  std::mt19937 random(4);
  for (int i = 0; i < 300; ++i) {
    const Bytes bytes = testing::random_bytes(record_size, random);
    Bytes again;
    append(again, decode_record(bytes).value());
    CHECK(again == bytes);
    const Request request{static_cast<RequestCommand>(random() % 0x10000),
                          static_cast<std::uint32_t>(random())};
    CHECK(decode_request(encode(request)).value() == request);
  }
}

TEST_CASE("a request with another first word or length is refused") {
  auto bytes = encode(Request{RequestCommand::set_bias, 0});
  CHECK_FALSE(decode_request(ByteView(bytes).first(7)));
  bytes[0] = 0x13;
  CHECK_FALSE(decode_request(bytes));
}

TEST_CASE("a datagram holds one to forty whole records") {
  CHECK(record_count(Bytes(36, 0)).value() == 1);
  CHECK(record_count(Bytes(40 * 36, 0)).value() == 40);
  for (const std::size_t size : {0U, 35U, 71U, 41U * 36U})
    CHECK_FALSE(record_count(Bytes(size, 0)));
}

// docs/reference/device-facts.md, Net F/T status word
TEST_CASE("only a latched monitor condition leaves values valid") {
  CHECK(values_valid(0));
  CHECK(values_valid(0x80010000));
  CHECK(values_valid(0x00010000));
  CHECK_FALSE(values_valid(0x80030000));  // with saturation
  for (unsigned bit = 0; bit < 31; ++bit) CHECK(values_valid(1U << bit) == (bit == 16));
}

TEST_CASE("the sequence tracker distinguishes first, next, gap, repeated and late records") {
  SequenceTracker tracker;
  CHECK(tracker.observe(10).event == SequenceEvent::first);
  CHECK(tracker.observe(11).event == SequenceEvent::contiguous);
  const SequenceStep gap = tracker.observe(15);
  CHECK(gap.event == SequenceEvent::gap);
  CHECK(gap.lost == 3);
  CHECK(tracker.observe(15).event == SequenceEvent::duplicate);
  CHECK(tracker.observe(13).event == SequenceEvent::out_of_order);
  CHECK(tracker.observe(16).event == SequenceEvent::contiguous);
  tracker.reset();
  CHECK(tracker.observe(1).event == SequenceEvent::first);
}

TEST_CASE("the sequence tracker counts on through the wrap") {
  SequenceTracker tracker;
  tracker.observe(0xFFFFFFFE);
  CHECK(tracker.observe(0xFFFFFFFF).event == SequenceEvent::contiguous);
  CHECK(tracker.observe(0).event == SequenceEvent::contiguous);
  tracker.observe(0xFFFFFFF0);  // late: ignored
  CHECK(tracker.observe(3).lost == 2);
  BasicSequenceTracker<std::uint16_t> narrow;
  narrow.observe(65535);
  CHECK(narrow.observe(4).lost == 4);
}

}  // namespace rdt_test
