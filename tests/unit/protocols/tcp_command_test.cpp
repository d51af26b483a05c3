#include "protocols/rdt/tcp_command.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace tcp_command_test {

using namespace weft;
using namespace weft::protocols::rdt;
using nlohmann::json;
using weft::testing::hex;

namespace {

CommandRequest request_of(const json& f) {
  switch (f.at("command").get<int>()) {
    case 0:
      return ReadFt{f.at("condition_mask"), f.at("bias"), f.at("clear_latch")};
    case 1:
      return ReadCalibration{};
    case 2:
      return WriteTransform{f.at("distance_unit"), f.at("angle_unit"), f.at("hundredths")};
    default:
      return WriteCondition{f.at("index"), f.at("axis"), f.at("output_code"), f.at("comparison"),
                            f.at("compared_with")};
  }
}

template <class Message>
void check_both_ways(const Message& expected, const Result<Message>& decoded, const Bytes& bytes) {
  REQUIRE(decoded);
  CHECK(*decoded == expected);
  Bytes encoded;
  append(encoded, expected);
  CHECK(encoded == bytes);
}

void check(const json& golden) {
  const json& f = golden.at("fields");
  const Bytes bytes = hex(golden.at("hex"));
  const std::string message = golden.at("message");
  if (message == "request")
    check_both_ways(request_of(f), decode_command(bytes), bytes);
  else if (message == "calibration")
    check_both_ways(
        CalibrationReply{f.at("force_unit"), f.at("torque_unit"), f.at("counts_per_force"),
                         f.at("counts_per_torque"), f.at("scale")},
        decode_calibration_reply(bytes), bytes);
  else
    check_both_ways(FtReply{f.at("status"), f.at("counts")}, decode_ft_reply(bytes), bytes);
}

}  // namespace

TEST_CASE("every vector of the command port decodes to its fields and encodes back to its bytes") {
  int seen = 0;
  for (const auto& vector : testing::load_vectors("rdt")) {
    const json golden = json::parse(vector.text);
    if (!golden.contains("message")) continue;
    INFO(vector.name);
    REQUIRE_FALSE(golden.at("source").get<std::string>().empty());
    check(golden);
    ++seen;
  }
  CHECK(seen == 7);
}

TEST_CASE("requests of another length or command, and replies of another first word, are refused") {
  for (const std::size_t size : {0U, 1U, 19U, 21U, 40U})
    CHECK(decode_command(Bytes(size, 0)).error().code == Errc::parse);
  Bytes request(command_size, 0);
  request[0] = 4;
  CHECK(decode_command(request).error().code == Errc::unsupported);
  CHECK(decode_ft_reply(Bytes(ft_reply_size, 0)).error().code == Errc::parse);
  CHECK(decode_ft_reply(hex("12 34")).error().code == Errc::parse);
  CHECK(decode_calibration_reply(Bytes(calibration_reply_size, 0x12)).error().code == Errc::parse);
  CHECK(decode_write_reply(hex("12 35 02 00")).error().code == Errc::parse);
  CHECK(decode_write_reply(hex("12 34 02 01")).value() ==
        WriteReply{TcpCommand::write_transform, 1});
}

TEST_CASE("random requests to the command port survive the wire") {
  std::mt19937 random(7);
  for (int i = 0; i < 300; ++i) {
    Bytes bytes = testing::random_bytes(command_size, random);
    bytes[0] = static_cast<std::uint8_t>(random() % 4);
    const CommandRequest once = decode_command(bytes).value();
    Bytes again;
    append(again, once);
    CHECK(again.size() == command_size);
    CHECK(decode_command(again).value() == once);
  }
}

TEST_CASE("units of a transform that the box does not have are refused") {
  CHECK(metres_per(3).value() == 0.001);
  CHECK(radians_per(1).value() == Approx(0.0174532925));
  for (const std::uint8_t none : {std::uint8_t{0}, std::uint8_t{6}, std::uint8_t{255}}) {
    CHECK(metres_per(none).error().code == Errc::unsupported);
    CHECK(radians_per(none).error().code == Errc::unsupported);
  }
}

}  // namespace tcp_command_test
