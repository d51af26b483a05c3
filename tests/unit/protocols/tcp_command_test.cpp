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

template <class Reply>
void check_written(const Reply& reply, const Bytes& bytes) {
  Bytes written;
  append(written, reply);
  CHECK(written == bytes);
}

void check(const json& golden) {
  const json& f = golden.at("fields");
  const Bytes bytes = hex(golden.at("hex"));
  const std::string message = golden.at("message");
  if (message == "request")
    CHECK(decode_command(bytes).value() == request_of(f));
  else if (message == "calibration")
    check_written(
        CalibrationReply{f.at("force_unit"), f.at("torque_unit"), f.at("counts_per_force"),
                         f.at("counts_per_torque"), f.at("scale")},
        bytes);
  else
    check_written(FtReply{f.at("status"), f.at("counts")}, bytes);
}

}  // namespace

TEST_CASE("every vector of the command port is read or written as its fields say") {
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

TEST_CASE("requests of another length or command are refused") {
  for (const std::size_t size : {0U, 1U, 19U, 21U, 40U})
    CHECK(decode_command(Bytes(size, 0)).error().code == Errc::parse);
  Bytes request(command_size, 0);
  request[0] = 4;
  CHECK(decode_command(request).error().code == Errc::unsupported);
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
