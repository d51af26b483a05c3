#include <catch2/catch.hpp>
#include <limits>

#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "tests/unit/protocols/streams.hpp"

namespace apt_test {

using namespace weft;
using namespace weft::protocols::apt;
using weft::testing::check_any_chunking;
using weft::testing::check_bounded;
using weft::testing::random_bytes;
using weft::testing::random_stream;
using weft::testing::split_in_pieces;

namespace {

constexpr std::int32_t lowest = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t highest = std::numeric_limits<std::int32_t>::max();
constexpr Route to_host{address::host, address::usb_unit};

template <class Body>
Body there_and_back(const Body& body) {
  Bytes data;
  append_body(data, body);
  CHECK(data.size() == body_size<Body>);
  return decode_body<Body>(data).value();
}

Message random_message(std::mt19937& random) {
  const Route route = random() % 2 == 0 ? Route{} : to_host;
  Message m{MessageId::move_completed, 0, 0, route.dest, route.source, {}};
  switch (random() % 5) {
    case 0:
      return {MessageId::move_home, 1, 0, route.dest, route.source, {}};
    case 1:
      return {MessageId::move_stop, 1, 2, route.dest, route.source, {}};
    case 2:
      m.data = random_bytes(14, random);
      return m;
    case 3:
      m.id = MessageId::hw_get_info;
      m.data = random_bytes(84, random);
      return m;
    default:  // an id outside the protocol's table
      m.id = static_cast<MessageId>(0x0A00 + random() % 0x100);
      m.data = random_bytes(1 + random() % max_data_size, random);
      return m;
  }
}

}  // namespace

TEST_CASE("every body survives the wire at the bounds of its integers") {
  const StatusUpdate status{0xFFFF, lowest, highest, 0xFFFFFFFF};
  CHECK(there_and_back(status) == status);
  const DcStatusUpdate dc{1, highest, -32768, 32767, 0x80000000};
  CHECK(there_and_back(dc) == dc);
  const JogParams jog{1,       JogMode::continuous, lowest, highest, lowest,
                      highest, StopMode::immediate};
  CHECK(there_and_back(jog) == jog);
  const LimitSwitchParams limits{1, 0x83, 0x82, lowest, highest, 0x81};
  CHECK(there_and_back(limits) == limits);
  const HardwareInfo info{
      lowest, Text<8>::from("KDC101"), 16, 1, 2, 3, 0, Text<48>::from("notes"), {}, 6, 1, 2, 3};
  CHECK(there_and_back(info) == info);
  const RichResponse response{0x0453, 9, Text<64>::from("over-current")};
  CHECK(there_and_back(response) == response);
  CHECK(there_and_back(StatusBits{1, 0x80000400}) == StatusBits{1, 0x80000400});
}

// device-facts.md, APT info reply: offsets of the fields inside the 84 bytes
TEST_CASE("the info reply has its fields where the document has them") {
  HardwareInfo info;
  info.notes = Text<48>::from("N");
  info.stage_id = 0x0607;
  info.hardware_version = 0x1112;
  info.modification_state = 0x2122;
  info.channels = 0x3132;
  Bytes data;
  append_body(data, info);
  CHECK(data.at(18) == 'N');
  CHECK(data.at(76) == 0x07);
  CHECK(data.at(78) == 0x12);
  CHECK(data.at(80) == 0x22);
  CHECK(data.at(82) == 0x32);
}

TEST_CASE("text is cut to its field and read up to the first zero") {
  CHECK(Text<4>::from("LTS150").str() == "LTS1");
  CHECK(Text<8>::from("LTS150").str() == "LTS150");
  Text<4> dirty;
  dirty.raw = {'a', 0x07, 0xFF, 'b'};
  CHECK(dirty.str() == "a??b");
}

TEST_CASE("a body of any other length is refused") {
  for (std::size_t size = 0; size <= 90; ++size) {
    const Bytes data(size, 0);
    CHECK(decode_body<StatusUpdate>(data).has_value() == (size == 14));
    CHECK(decode_body<HardwareInfo>(data).has_value() == (size == 84));
  }
}

TEST_CASE("random messages survive encoding and decoding") {
  std::mt19937 random(1);
  for (int i = 0; i < 500; ++i) {
    const Message message = random_message(random);
    const Result<Message> back = decode(encode(message));
    REQUIRE(back);
    CHECK(*back == message);
  }
}

TEST_CASE("a message that is truncated or has bytes left over is refused") {
  const Bytes whole = encode(make_message(MessageId::move_absolute, ChannelCounts{1, 2048}, {}));
  for (std::size_t size = 0; size < whole.size(); ++size)
    CHECK_FALSE(decode(ByteView(whole).first(size)));
  Bytes longer = whole;
  longer.push_back(0);
  CHECK_FALSE(decode(longer));
  Bytes absurd = whole;
  absurd[2] = absurd[3] = 0xFF;
  CHECK(decode(absurd).error().code == Errc::parse);
}

TEST_CASE("any chunking of an APT stream gives the same messages") {
  std::mt19937 random(2);
  check_any_chunking<Splitter>(random, random_message);
}

TEST_CASE("the splitter finds the next message behind garbage, and counts the garbage") {
  const Bytes good = encode(make_message(MessageId::get_statusupdate, StatusUpdate{}, to_host));
  for (const Bytes& garbage :
       {Bytes{0xFF}, Bytes(100, 0x00), Bytes{0x81, 0x04, 0x0E, 0x00, 0x81}, Bytes(13, 0x55),
        Bytes{0x81, 0x04, 0x0F, 0x00, 0x81, 0x50},     // known id, wrong length
        Bytes{0x81, 0x04, 0x01, 0x00, 0x01, 0x50},     // known id, wrong form
        Bytes{0x00, 0x0A, 0x00, 0x01, 0x81, 0x50}}) {  // 256 bytes of data
    Bytes stream = garbage;
    stream.insert(stream.end(), good.begin(), good.end());
    Splitter splitter;
    splitter.push(stream);
    Message message;
    REQUIRE(splitter.next(message));
    CHECK(encode(message) == good);
    CHECK(splitter.skipped_bytes() == garbage.size());
  }
}

TEST_CASE("a controller's splitter takes a message of undocumented length whole") {
  Bytes stream;
  const Bytes odd = encode({MessageId::set_velparams, 0, 0, 0x50, 0x01, Bytes(40, 0x50)});
  const Bytes long_home = encode({MessageId::move_home, 0, 0, 0x50, 0x01, Bytes(7, 0x01)});
  const Bytes good = encode({MessageId::hw_req_info, 0, 0, 0x50, 0x01, {}});
  for (const Bytes& bytes : {odd, long_home, good})
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  Splitter splitter(LineEnd::controller);
  splitter.push(stream);
  Message message;
  for (const Bytes& bytes : {odd, long_home, good}) {
    REQUIRE(splitter.next(message));
    CHECK(encode(message) == bytes);
  }
  CHECK(splitter.skipped_bytes() == 0);
  CHECK_FALSE(splitter.in_progress());
  splitter.push(ByteView(good).first(3));
  CHECK_FALSE(splitter.next(message));
  CHECK(splitter.in_progress());
}

TEST_CASE("bit flips, cuts and noise neither crash the APT splitter nor deafen it") {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    Bytes bytes = random_stream(20, random, random_message).bytes;
    for (int flips = 0; flips < 8; ++flips)
      bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    bytes.resize(bytes.size() - random() % 10);
    // No false header can consume more than one message of the greatest length.
    const Bytes quiet(header_size + max_data_size, 0);
    bytes.insert(bytes.end(), quiet.begin(), quiet.end());
    const Message last{MessageId::move_homed, 1, 0, address::host, address::usb_unit, {}};
    append(bytes, last);
    Splitter splitter;
    const auto messages = split_in_pieces<Splitter, Message>(splitter, bytes, 300, random);
    REQUIRE_FALSE(messages.empty());
    CHECK(messages.back() == last);
  }
}

TEST_CASE("an APT splitter that is not drained stays bounded and counts dropped bytes") {
  check_bounded<Splitter>(0x01);
}

TEST_CASE("a message in progress is forgotten on request") {
  const Bytes good = encode(make_message(MessageId::get_statusupdate, StatusUpdate{}, to_host));
  Splitter splitter;
  splitter.push(ByteView(good).first(10));
  splitter.clear();
  splitter.push(good);
  Message message;
  CHECK(splitter.next(message));
  CHECK(splitter.skipped_bytes() == 0);
}

}  // namespace apt_test
