// Discovery of boxes of ATI: bytes like those of ATI's own client.
#include "protocols/rdt/discovery.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/hex.hpp"

namespace discovery_test {

using namespace weft;
using namespace weft::protocols::rdt;
using weft::testing::hex;

namespace {

// "RTA Device DiscoveryRTAD", field 2: 224.0.5.128, field F2: 7 (RTADiscoveryProtocol).
const char request_bytes[] =
    "52 54 41 20 44 65 76 69 63 65 20 44 69 73 63 6F 76 65 72 79 52 54 41 44 "
    "02 04 E0 00 05 80 F2 01 07";
// Computed from that client's parser: MAC, address, mask, "Net F/T", an unknown field (82).
const char reply_bytes[] =
    "52 54 41 44 01 06 00 16 BD 01 02 03 02 04 C0 A8 01 01 03 04 FF FF FF 00 "
    "82 01 09 0D 07 4E 65 74 20 46 2F 54";

}  // namespace

TEST_CASE("A discovery request is what ATI's client sends") {
  CHECK(encode(DiscoveryRequest{}) == hex(request_bytes));
  const auto request = decode_discovery_request(hex(request_bytes));
  REQUIRE(request);
  CHECK(*request == DiscoveryRequest{});
  CHECK(decode_discovery_request(encode(DiscoveryRequest{{127, 0, 0, 1}, 1}))->delay_ms == 1);
}

TEST_CASE("A discovery reply has name and address of the box") {
  const auto reply = decode_discovery_reply(hex(reply_bytes));
  REQUIRE(reply);
  CHECK(reply->mac == "00-16-bd-01-02-03");
  CHECK(reply->address == Ipv4{192, 168, 1, 1});
  CHECK(reply->netmask == Ipv4{255, 255, 255, 0});
  CHECK(reply->application == "Net F/T");
  CHECK(reply->location.empty());
  const auto again = decode_discovery_reply(encode(*reply));
  REQUIRE(again);
  CHECK(*again == *reply);
}

TEST_CASE("Zeros behind a reply are no field, and damaged replies are refused") {
  Bytes bytes = hex(reply_bytes);
  bytes.resize(205);  // the size of the buffer of ATI's client
  REQUIRE(decode_discovery_reply(bytes));
  for (std::size_t size = 0; size < 16; ++size) {
    const auto cut = decode_discovery_reply(ByteView(bytes).first(size));
    REQUIRE_FALSE(cut);
    CHECK(cut.error().code == Errc::parse);
  }
  CHECK_FALSE(decode_discovery_reply(hex("52 54 41 44 02 03 C0 A8 01")));
  for (const char* const group : {"E0 00 05 80", "FF FF FF FF", "00 00 00 00"}) {
    const auto many = decode_discovery_reply(hex(std::string("52 54 41 44 02 04 ") + group));
    REQUIRE_FALSE(many);
    CHECK(many.error().code == Errc::parse);
  }
  CHECK_FALSE(decode_discovery_reply(hex(request_bytes)));
  CHECK_FALSE(decode_discovery_request(hex(reply_bytes)));
}

}  // namespace discovery_test
