#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "protocols/base/bytes.hpp"
#include "protocols/modbus/rtu.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace modbus_test {

using namespace weft;
using namespace weft::protocols::modbus;
using nlohmann::json;
using weft::testing::hex;
using weft::testing::random_bytes;

namespace {

Registers registers_of(const json& fields) {
  return Registers(fields.at("registers").get<std::vector<std::uint16_t>>());
}

Request request_of(const json& f) {
  const auto function = static_cast<Function>(f.at("function").get<int>());
  if (f.contains("data")) return Vendor{function, f.at("data")};
  if (f.contains("value")) return WriteOne{f.at("address"), f.at("value")};
  if (f.contains("registers")) return WriteMany{f.at("address"), registers_of(f)};
  return Read{function, f.at("address"), f.at("count")};
}

Reply reply_of(const json& f) {
  const auto function = static_cast<Function>(f.at("function").get<int>());
  if (f.contains("exception"))
    return Exception{f.at("function"), static_cast<ExceptionCode>(f.at("exception").get<int>())};
  if (f.contains("data")) return Vendor{function, f.at("data")};
  if (f.contains("value")) return WriteOne{f.at("address"), f.at("value")};
  if (f.contains("registers")) return ReadReply{function, registers_of(f)};
  return WroteMany{f.at("address"), f.at("count")};
}

Result<Request> decoded(ByteView pdu, const Request&) {
  return decode_request(pdu);
}
Result<Reply> decoded(ByteView pdu, const Reply&) {
  return decode_reply(pdu);
}

template <class Message>
void check_rtu(const Bytes& bytes, const Message& expected, Side side, std::uint8_t slave) {
  Bytes encoded;
  append_rtu(encoded, slave, expected);
  CHECK(encoded == bytes);
  RtuSplitter splitter(side, slave);
  splitter.push(bytes);
  const auto pdu = splitter.next();
  REQUIRE(pdu);
  CHECK(decoded(*pdu, expected).value() == expected);
  CHECK_FALSE(splitter.next());
  CHECK(splitter.skipped_bytes() == 0);
}

template <class Message>
void check_mbap(const Bytes& bytes, const Message& expected, const json& f) {
  Bytes encoded;
  append_mbap(encoded, f.at("transaction"), f.at("slave"), expected);
  CHECK(encoded == bytes);
  MbapSplitter splitter;
  splitter.push(bytes);
  const auto frame = splitter.next();
  REQUIRE(frame);
  CHECK(frame->transaction == f.at("transaction").get<int>());
  CHECK(frame->unit == f.at("slave").get<int>());
  CHECK(decoded(frame->pdu, expected).value() == expected);
}

template <class Message>
void check_vector(const json& golden, const Message& expected, Side side) {
  const json& f = golden.at("fields");
  const Bytes bytes = hex(golden.at("hex"));
  if (f.at("framing") == "rtu")
    check_rtu(bytes, expected, side, f.at("slave"));
  else
    check_mbap(bytes, expected, f);
}

Request random_request(std::mt19937& random) {
  const auto word = [&] { return static_cast<std::uint16_t>(random()); };
  switch (random() % 4) {
    case 0:
      return Read{random() % 2 == 0 ? Function::read_holding : Function::read_input, word(),
                  static_cast<std::uint16_t>(1 + random() % most_read)};
    case 1:
      return WriteOne{word(), word()};
    case 2:
      return Vendor{random() % 2 == 0 ? Function::vendor_stream : Function::vendor_lock,
                    static_cast<std::uint8_t>(random())};
    default: {
      WriteMany write{word(), {}};
      write.registers.count = static_cast<std::uint8_t>(1 + random() % most_written);
      for (std::size_t i = 0; i < write.registers.count; ++i) write.registers.values[i] = word();
      return write;
    }
  }
}

/// Requests from a splitter, in pieces of up to `longest` bytes.
std::vector<Request> requests_in(ByteView stream, std::size_t longest, std::mt19937& random) {
  RtuSplitter splitter(Side::requests, 10);
  std::vector<Request> out;
  while (!stream.empty()) {
    const std::size_t piece = std::min<std::size_t>(1 + random() % longest, stream.size());
    splitter.push(stream.first(piece));
    stream = stream.subspan(piece);
    while (const auto pdu = splitter.next()) out.push_back(decode_request(*pdu).value());
  }
  return out;
}

Errc refused_request(const std::string& pdu) {
  const Result<Request> request = decode_request(hex(pdu));
  REQUIRE_FALSE(request);
  return request.error().code;
}

}  // namespace

TEST_CASE("every Modbus vector decodes to its fields and encodes back to its bytes") {
  const auto vectors = testing::load_vectors("modbus");
  REQUIRE(vectors.size() >= 39);
  for (const auto& vector : vectors) {
    INFO(vector.name);
    const json golden = json::parse(vector.text);
    REQUIRE_FALSE(golden.at("source").get<std::string>().empty());
    if (golden.at("fields").at("side") == "request")
      check_vector(golden, request_of(golden.at("fields")), Side::requests);
    else
      check_vector(golden, reply_of(golden.at("fields")), Side::replies);
  }
}

TEST_CASE("any chunking of Modbus requests gives the same requests") {
  std::mt19937 random(1);
  Bytes stream;
  std::vector<Request> expected;
  for (int i = 0; i < 200; ++i) {
    expected.push_back(random_request(random));
    append_rtu(stream, 10, expected.back());
  }
  for (const std::size_t longest : {1U, 2U, 7U, 100U, 4000U})
    CHECK(requests_in(stream, longest, random) == expected);
}

TEST_CASE("a flipped bit costs one Modbus request, never makes a wrong one") {
  std::mt19937 random(2);
  for (int round = 0; round < 300; ++round) {
    Bytes stream;
    std::vector<Request> expected;
    std::vector<std::size_t> starts;
    for (int i = 0; i < 4; ++i) {
      starts.push_back(stream.size());
      expected.push_back(random_request(random));
      append_rtu(stream, 10, expected.back());
    }
    const std::size_t at = starts[1] + random() % (starts[2] - starts[1]);
    stream[at] ^= static_cast<std::uint8_t>(1U << random() % 8);
    stream.insert(stream.end(), 300, 0);  // a false length may extend this far
    expected.erase(expected.begin() + 1);
    CHECK(requests_in(stream, 50, random) == expected);
  }
}

TEST_CASE("a truncated request is forgotten when the line has been silent") {
  RtuSplitter splitter(Side::requests, 10);
  splitter.push(hex("0A 10 00 00 00 06 0C 02"));
  CHECK_FALSE(splitter.next());
  CHECK(splitter.rest().size() == 8);
  splitter.clear();
  splitter.push(hex("0A 03 00 1D 00 01 15 77"));
  CHECK(splitter.next());
}

TEST_CASE("frames of other slaves are not this slave's") {
  RtuSplitter splitter(Side::requests, 10);
  Bytes stream;
  append_rtu(stream, 11, Request(WriteOne{1, 2}));
  append_rtu(stream, 10, Request(WriteOne{3, 4}));
  splitter.push(stream);
  const auto pdu = splitter.next();
  REQUIRE(pdu);
  CHECK(decode_request(*pdu).value() == Request(WriteOne{3, 4}));
  CHECK(splitter.skipped_bytes() == 8);
}

TEST_CASE("noise gives no Modbus frames, and a splitter that is not drained stays bounded") {
  std::mt19937 random(3);
  RtuSplitter rtu(Side::replies, 10);
  MbapSplitter mbap;
  for (int i = 0; i < 200; ++i) {
    const Bytes noise = random_bytes(1000, random);
    rtu.push(noise);
    CHECK_FALSE(rtu.next());
    mbap.push(noise);
    while (mbap.next()) {  // without a check value a plausible head makes a frame
    }
  }
  CHECK(rtu.skipped_bytes() > 199000);
  RtuSplitter full(Side::requests, 10);
  full.push(Bytes(RtuSplitter::capacity + 500, 10));
  CHECK(full.skipped_bytes() == 500);
}

TEST_CASE("standard functions that are not served are framed and refused as unknown") {
  for (const char* text : {"0A 01 00 00 00 08", "0A 11", "0A 0F 00 00 00 08 01 FF",
                           "0A 17 00 00 00 01 00 00 00 01 02 00 00"}) {
    Bytes frame = hex(text);
    LittleWriter(frame).write(crc16_modbus(frame));
    RtuSplitter splitter(Side::requests, 10);
    splitter.push(frame);
    const auto pdu = splitter.next();
    REQUIRE(pdu);
    CHECK(decode_request(*pdu).error().code == Errc::unsupported);
  }
}

namespace {

Bytes framed(const std::string& text) {
  Bytes frame = hex(text);
  LittleWriter(frame).write(crc16_modbus(frame));
  return frame;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// The PDUs of requests to slave 10, byte by byte or in larger pieces.
std::vector<Bytes> pdus_in(const Bytes& stream, std::size_t piece) {
  RtuSplitter splitter(Side::requests, 10);
  std::vector<Bytes> out;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    splitter.push(ByteView(stream).subspan(at, std::min(piece, stream.size() - at)));
    while (const auto pdu = splitter.next()) out.emplace_back(pdu->begin(), pdu->end());
  }
  return out;
}

}  // namespace

TEST_CASE("a function of any length is framed by its check value, and holds up nothing behind it") {
  const Bytes identify = framed("0A 2B 0E 01 00"), odd = framed("0A 64 01 02 03 04 05 06 07");
  const Bytes read = framed("0A 03 00 1D 00 01"), file = framed("0A 14 07 06 00 04 00 01 00 02");
  const auto pdu = [](const Bytes& frame) { return Bytes(frame.begin() + 1, frame.end() - 2); };
  Bytes damaged = odd;
  damaged[4] ^= 1;
  for (const std::size_t piece : {1U, 3U, 1000U}) {
    CHECK(pdus_in(joined({identify, read, odd, file}), piece) ==
          std::vector<Bytes>{pdu(identify), pdu(read), pdu(odd), pdu(file)});
    CHECK(pdus_in(joined({damaged, read, read}), piece) ==
          std::vector<Bytes>{pdu(read), pdu(read)});
    CHECK(pdus_in(joined({Bytes(72, 0), read}), piece) == std::vector<Bytes>{pdu(read)});
    CHECK(pdus_in(framed("0A 83 02"), piece).empty());  // an exception of another slave
  }
}

TEST_CASE("what is written to all slaves is told apart, what is read from all is not taken") {
  RtuSplitter splitter(Side::requests, 10);
  splitter.push(joined({framed("00 06 00 1F 00 02"), framed("0A 03 00 1D 00 01"),
                        framed("00 10 00 00 00 01 02 00 05"), framed("00 03 00 1D 00 01")}));
  CHECK(decode_request(splitter.next().value()).value() == Request(WriteOne{0x1F, 2}));
  CHECK(splitter.to_all());
  CHECK(splitter.next());
  CHECK_FALSE(splitter.to_all());
  CHECK(std::holds_alternative<WriteMany>(decode_request(splitter.next().value()).value()));
  CHECK(splitter.to_all());
  CHECK_FALSE(splitter.next());
}

TEST_CASE("whole Modbus TCP frames are distinguished from half ones") {
  const Bytes frame = hex("12 34 00 00 00 06 0A 03 00 1D 00 01");
  for (std::size_t cut = 0; cut < frame.size(); ++cut) {
    const Bytes part(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(cut));
    CHECK(whole_mbap_frames(part) == 0);
    CHECK(whole_mbap_frames(joined({frame, part})) == frame.size());
  }
  CHECK(whole_mbap_frames(Bytes(5, 0xFF)) == 0);
  CHECK(whole_mbap_frames(joined({Bytes(7, 0xFF), frame})) == 7 + frame.size());
}

TEST_CASE("Modbus messages of a wrong length or with absurd counts are refused") {
  CHECK(refused_request("") == Errc::unsupported);
  CHECK(refused_request("03 00 00 00") == Errc::parse);
  CHECK(refused_request("03 00 00 00 01 00") == Errc::parse);
  CHECK(refused_request("03 00 00 00 00") == Errc::range);
  CHECK(refused_request("03 00 00 00 7E") == Errc::range);
  CHECK(refused_request("10 00 00 00 7C F8") == Errc::range);
  CHECK(refused_request("10 00 00 00 01 04 00 01") == Errc::range);
  CHECK(refused_request("10 00 00 00 02 04 00 01") == Errc::parse);
  CHECK(refused_request("46") == Errc::parse);
  for (const char* pdu :
       {"", "03 00", "03 03 00 00 00", "03 04 00 00", "05 00", "83", "46 01 01"}) {
    const Result<Reply> reply = decode_reply(hex(pdu));
    CHECK_FALSE(reply);
  }
}

TEST_CASE("a reply answers a request of its kind, and an exception one of its function") {
  const Request read = Read{Function::read_holding, 5, 2};
  CHECK(
      answers(ReadReply{Function::read_holding, Registers(std::array<std::uint16_t, 2>{})}, read));
  CHECK_FALSE(
      answers(ReadReply{Function::read_input, Registers(std::array<std::uint16_t, 2>{})}, read));
  CHECK_FALSE(
      answers(ReadReply{Function::read_holding, Registers(std::array<std::uint16_t, 3>{})}, read));
  CHECK(answers(Exception{3, ExceptionCode::busy}, read));
  CHECK_FALSE(answers(Exception{4, ExceptionCode::busy}, read));
  CHECK(answers(WroteMany{6, 1}, WriteMany{6, Registers(std::array<std::uint16_t, 1>{})}));
  CHECK_FALSE(answers(WroteMany{7, 1}, WriteMany{6, Registers(std::array<std::uint16_t, 1>{})}));
  CHECK_FALSE(answers(WriteOne{1, 2}, Request(WriteOne{1, 3})));
  CHECK_FALSE(
      answers(Vendor{Function::vendor_lock, 1}, Request(Vendor{Function::vendor_stream, 0x55})));
}

}  // namespace modbus_test
