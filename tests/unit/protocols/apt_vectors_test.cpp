#include <catch2/catch.hpp>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace apt_vectors_test {

using namespace weft;
using namespace weft::protocols::apt;
using nlohmann::json;
using weft::testing::hex;
using weft::testing::Vector;

namespace {

// One mapping per layout between the vector's field names and the struct, written out by hand: the
// names in the vectors must not come from the code under test.
void from_json_fields(const json& f, ChannelCounts& b) {
  b = {f.at("channel"), f.at("value_counts")};
}
void from_json_fields(const json& f, VelocityParams& b) {
  b = {f.at("channel"), f.at("minimum_velocity_counts"), f.at("acceleration_counts"),
       f.at("maximum_velocity_counts")};
}
void from_json_fields(const json& f, JogParams& b) {
  b = {f.at("channel"),
       static_cast<JogMode>(f.at("mode").get<std::uint16_t>()),
       f.at("step_counts"),
       f.at("minimum_velocity_counts"),
       f.at("acceleration_counts"),
       f.at("maximum_velocity_counts"),
       static_cast<StopMode>(f.at("stop_mode").get<std::uint16_t>())};
}
void from_json_fields(const json& f, LimitSwitchParams& b) {
  b = {f.at("channel"),
       f.at("forward_hardware"),
       f.at("reverse_hardware"),
       f.at("forward_soft_counts"),
       f.at("reverse_soft_counts"),
       f.at("soft_mode")};
}
void from_json_fields(const json& f, PowerParams& b) {
  b = {f.at("channel"), f.at("rest_percent"), f.at("move_percent")};
}
void from_json_fields(const json& f, HomeParams& b) {
  b = {f.at("channel"), f.at("direction"), f.at("limit_switch"), f.at("velocity_counts"),
       f.at("offset_counts")};
}
void from_json_fields(const json& f, StatusUpdate& b) {
  b = {f.at("channel"), f.at("position_counts"), f.at("encoder_counts"), f.at("status_bits")};
}
void from_json_fields(const json& f, DcStatusUpdate& b) {
  b = {f.at("channel"), f.at("position_counts"), f.at("velocity_counts"), f.at("motor_current_ma"),
       f.at("status_bits")};
}
void from_json_fields(const json& f, BowIndex& b) {
  b = {f.at("channel"), f.at("index")};
}
void from_json_fields(const json& f, PotParams& b) {
  b = {f.at("channel"),
       f.at("zero_window"),
       f.at("velocity1_counts_s"),
       f.at("window1"),
       f.at("velocity2_counts_s"),
       f.at("window2"),
       f.at("velocity3_counts_s"),
       f.at("window3"),
       f.at("velocity4_counts_s")};
}
void from_json_fields(const json& f, ButtonParams& b) {
  b = {f.at("channel"),          f.at("mode"),        f.at("position1_counts"),
       f.at("position2_counts"), f.at("timeout1_ms"), f.at("timeout2_ms")};
}
void from_json_fields(const json& f, KcubePanelParams& b) {
  b = {f.at("channel"),
       f.at("mode"),
       f.at("maximum_velocity_counts"),
       f.at("acceleration_counts"),
       f.at("direction"),
       f.at("position1_counts"),
       f.at("position2_counts"),
       f.at("brightness_percent"),
       f.at("dim_after_min"),
       f.at("dim_level")};
}
void from_json_fields(const json& f, AdcInputs& b) {
  b = {f.at("input1_counts"), f.at("input2_counts")};
}
void from_json_fields(const json& f, RackStatusBits& b) {
  b = {f.at("bits")};
}
void from_json_fields(const json& f, HardwareInfo& b) {
  b = {};
  b.serial = f.at("serial");
  b.model = Text<8>::from(f.at("model").get<std::string>());
  b.hardware_type = f.at("hardware_type");
  b.firmware_minor = f.at("firmware_minor");
  b.firmware_interim = f.at("firmware_interim");
  b.firmware_major = f.at("firmware_major");
  b.channels = 0;
}

template <class Body>
void check_body(const json& fields, const Message& decoded, const Bytes& bytes) {
  Body expected;
  from_json_fields(fields.at("data"), expected);
  const Result<Body> body = decode_body<Body>(decoded.data);
  REQUIRE(body);
  CHECK(*body == expected);
  Bytes encoded;
  append_message(encoded, static_cast<MessageId>(fields.at("id").get<unsigned>()), expected,
                 Route{fields.at("dest"), fields.at("source")});
  CHECK(encoded == bytes);
}

using BodyCheck = std::function<void(const json&, const Message&, const Bytes&)>;
const std::map<std::string, BodyCheck> body_checks{
    {"ChannelCounts", check_body<ChannelCounts>},
    {"VelocityParams", check_body<VelocityParams>},
    {"JogParams", check_body<JogParams>},
    {"LimitSwitchParams", check_body<LimitSwitchParams>},
    {"PowerParams", check_body<PowerParams>},
    {"HomeParams", check_body<HomeParams>},
    {"StatusUpdate", check_body<StatusUpdate>},
    {"DcStatusUpdate", check_body<DcStatusUpdate>},
    {"BowIndex", check_body<BowIndex>},
    {"HardwareInfo", check_body<HardwareInfo>},
    {"PotParams", check_body<PotParams>},
    {"ButtonParams", check_body<ButtonParams>},
    {"KcubePanelParams", check_body<KcubePanelParams>},
    {"AdcInputs", check_body<AdcInputs>},
    {"RackStatusBits", check_body<RackStatusBits>},
};

Bytes bytes_of(const json& vector) {
  Bytes bytes = hex(vector.at("hex"));
  if (vector.contains("beginning")) bytes.resize(90, 0);  // HW_GET_INFO, completed with zeros
  return bytes;
}

}  // namespace

TEST_CASE("every APT vector decodes to its fields and encodes back to its bytes") {
  const std::vector<Vector> vectors = testing::load_vectors("apt");
  REQUIRE(vectors.size() >= 54);
  for (const Vector& vector : vectors) {
    INFO(vector.name);
    const json golden = json::parse(vector.text);
    REQUIRE_FALSE(golden.at("source").get<std::string>().empty());
    const Bytes bytes = bytes_of(golden);
    const json& fields = golden.at("fields");
    const Result<Message> message = decode(bytes);
    REQUIRE(message);
    CHECK(static_cast<unsigned>(message->id) == fields.at("id").get<unsigned>());
    CHECK(message->dest == fields.at("dest").get<unsigned>());
    CHECK(message->source == fields.at("source").get<unsigned>());
    CHECK(message->param1 == fields.value("param1", 0U));
    CHECK(message->param2 == fields.value("param2", 0U));
    CHECK(encode(*message) == bytes);
    if (fields.contains("body"))
      body_checks.at(fields.at("body"))(fields, *message, bytes);
    else
      CHECK(message->data.empty());
  }
}

TEST_CASE("the splitter takes every APT vector out of one stream, in order") {
  Bytes stream;
  std::vector<Message> expected;
  for (const Vector& vector : testing::load_vectors("apt")) {
    const Bytes bytes = bytes_of(json::parse(vector.text));
    stream.insert(stream.end(), bytes.begin(), bytes.end());
    expected.push_back(decode(bytes).value());
  }
  Splitter splitter;
  splitter.push(stream);
  Message message;
  for (const Message& e : expected) {
    REQUIRE(splitter.next(message));
    CHECK(message == e);
  }
  CHECK_FALSE(splitter.next(message));
  CHECK(splitter.skipped_bytes() == 0);
}

// docs/reference/device-facts.md, APT scales: the numbers of the table, against the counts that
// peers were seen to send
TEST_CASE("stage scales give the counts that other programs send") {
  const StageModel& prm = *find_stage("PRM1-Z8");
  CHECK(position_to_counts(prm.scale, 10).value() == 19196);   // pylablib
  CHECK(position_to_counts(prm.scale, 5).value() == 9598);     // InstrumentKit
  CHECK(position_to_counts(prm.scale, 90).value() == 172768);  // computed
  CHECK(position_to_counts(prm.scale, -30).value() == -57589);
  CHECK(velocity_to_counts(prm.scale, 10).value() == 0x068D69);
  CHECK(acceleration_to_counts(prm.scale, 10).value() == 0x93);
  const StageModel& lts = *find_stage("LTS150");
  CHECK(position_to_counts(lts.scale, 75).value() == 30720000);
  CHECK(velocity_to_counts(lts.scale, 20).value() == 0x1A360000);
  CHECK(acceleration_to_counts(lts.scale, 20).value() == 0x016008);
  CHECK(position_from_counts(lts.scale, 30720000) == Approx(75).epsilon(1e-15));
  CHECK(velocity_from_counts(lts.scale, 0x1A360000) == Approx(20).epsilon(1e-15));
  CHECK(acceleration_from_counts(lts.scale, 0x016008) == Approx(20).epsilon(1e-15));
}

// APT16 section 8: VEL = C T 65536 v and ACC = C T^2 65536 a with T = 2048 / 6 MHz for servos;
// factors 53.68 and 1 / 90.9 for Trinamic steppers
TEST_CASE("velocity and acceleration scales follow from the position scale as APT16 says") {
  for (const StageModel& model : stage_models()) {
    INFO(model.name);
    const double c = model.scale.counts_per_unit;
    const bool servo = model.family == Family::servo;
    const double t = 2048.0 / 6e6;
    CHECK(model.scale.velocity_counts == Approx(servo ? c * t * 65536 : c * 53.68).epsilon(1e-4));
    CHECK(model.scale.acceleration_counts ==
          Approx(servo ? c * t * t * 65536 : c / 90.9).epsilon(1e-3));
  }
}

TEST_CASE("counts that do not fit 32 bits are refused, and so are NaN and infinity") {
  const StageScale& lts = find_stage("LTS150")->scale;
  CHECK(position_to_counts(lts, 5242));  // end of the 32-bit field
  CHECK_FALSE(position_to_counts(lts, 5243));
  CHECK_FALSE(position_to_counts(lts, -5243));
  CHECK(velocity_to_counts(lts, 97.6));
  CHECK_FALSE(velocity_to_counts(lts, 97.7));
  CHECK_FALSE(position_to_counts(lts, std::numeric_limits<double>::quiet_NaN()));
  CHECK_FALSE(velocity_to_counts(lts, std::numeric_limits<double>::infinity()));
  CHECK(acceleration_to_counts(lts, 1e300).error().code == Errc::range);
}

}  // namespace apt_vectors_test
