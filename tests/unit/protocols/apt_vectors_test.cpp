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

// One hand-written mapping per layout between the vector's field names and the struct: the names in
// the vectors must not come from the tested code.
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

// docs/reference/device-facts.md, APT scales: the numbers of the table, compared with the counts of
// other programs
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

// APT16 section 8: VEL = C T 65536 v and ACC = C T^2 65536 a, with T = 2048 / 6 MHz for servos and
// 102.4 us for brushless drives; factors 53.68 and 1 / 90.9 for Trinamic steppers; one count for
// all on the older ones
TEST_CASE("velocity and acceleration scales follow from the position scale as in APT16") {
  for (const Pairing& pairing : stage_pairings()) {
    INFO(pairing.stage << " on " << pairing.name);
    const double c = pairing.scale.counts_per_unit;
    const bool brushless = pairing.prefix.substr(1, 2) == "BD";
    const bool servo = find_controller(pairing.prefix)->family == Family::servo;
    const double t = brushless ? 102.4e-6 : 2048.0 / 6e6;
    const bool old = pairing.name == "BSC10x" || pairing.name == "TST001";
    CHECK(pairing.scale.velocity_counts == Approx(servo ? c * t * 65536
                                                  : old ? c
                                                        : c * 53.68)
                                               .epsilon(1e-4));
    CHECK(pairing.scale.acceleration_counts == Approx(servo ? c * t * t * 65536
                                                      : old ? c
                                                            : c / 90.9)
                                                   .epsilon(1e-3));
  }
}

TEST_CASE("every stage has a controller, counts that fit, and limits that make sense") {
  for (const StageModel& model : stage_models()) {
    INFO(model.name);
    const StageModel* usual = find_stage(model.name, model.usual_controller);
    REQUIRE(usual != nullptr);
    CHECK(usual->scale == model.scale);
    CHECK(usual->family == model.family);
    CHECK(model.travel_low < model.travel_high);
    CHECK(model.default_speed <= model.max_speed);
    CHECK(model.default_acceleration <= model.max_acceleration);
    CHECK(model.home_speed <= model.max_speed);
    CHECK_FALSE(model.source.empty());
    CHECK(velocity_to_counts(model.scale, model.max_speed));
    CHECK(position_to_counts(model.scale, model.travel_high));
    CHECK(acceleration_to_counts(model.scale, model.default_acceleration).value() > 0);
  }
}

TEST_CASE("a stage counts as its controller does, and on an unknown one not at all") {
  CHECK(find_stage("NRT150", "BSC203")->scale.counts_per_unit == 409600);
  CHECK(find_stage("NRT150", "BSC101")->scale.counts_per_unit == 25600);
  CHECK(find_stage("LTS150", "TST001")->scale.velocity_counts == 25600);
  CHECK(find_stage("LTS300", "LTS300")->travel_high == 300);
  for (const auto& [stage, controller] : {std::pair{"LTS150", "LTS300"},
                                          {"LTS300", "TST001"},
                                          {"MTS50-Z8", "BSC201"},
                                          {"DDS220", "KDC101"},
                                          {"PRM1-Z8", "KST101"},
                                          {"PRM1-Z8", ""},
                                          {"unknown", "KDC101"}})
    CHECK(find_stage(stage, controller) == nullptr);
}

// SET_VELPARAMS, MOVE_ABSOLUTE and status of the stages that the golden files do not have, computed
// from device-facts.md, APT scales
TEST_CASE("stages of each family have the bytes of their scale") {
  const auto velocity = [](const char* stage, double speed, double acceleration) {
    const StageScale& scale = find_stage(stage)->scale;
    return encode(
        make_message(MessageId::set_velparams,
                     VelocityParams{1, 0, acceleration_to_counts(scale, acceleration).value(),
                                    velocity_to_counts(scale, speed).value()},
                     {address::usb_unit, address::host}));
  };
  const auto absolute = [](const char* stage, double target) {
    return encode(
        make_message(MessageId::move_absolute,
                     ChannelCounts{1, position_to_counts(find_stage(stage)->scale, target).value()},
                     {address::usb_unit, address::host}));
  };
  // 2.4 x 767367.49 = 1841682, 1.5 x 261.93 = 393; 25 x 34304 = 857600
  CHECK(velocity("MTS50-Z8", 2.4, 1.5) ==
        hex("13 04 0E 00 D0 01 01 00 00 00 00 00 89 01 00 00 12 1A 1C 00"));
  CHECK(absolute("MTS50-Z8", 25) == hex("53 04 06 00 D0 01 01 00 00 16 0D 00"));
  // 100 x 134217.73 = 13421773, 500 x 13.744 = 6872; 110 x 20000 = 2200000
  CHECK(velocity("DDS220", 100, 500) ==
        hex("13 04 0E 00 D0 01 01 00 00 00 00 00 D8 1A 00 00 CD CC CC 00"));
  CHECK(absolute("DDS220", 110) == hex("53 04 06 00 D0 01 01 00 C0 91 21 00"));
  // 300 x 409600 = 122880000
  CHECK(absolute("LTS300", 300) == hex("53 04 06 00 D0 01 01 00 00 00 53 07"));
  // 10 x 7329109 = 73291090, 20 x 1502 = 30040; 90 x 136533.33 = 12288000
  CHECK(velocity("K10CR1", 10, 20) ==
        hex("13 04 0E 00 D0 01 01 00 00 00 00 00 58 75 00 00 52 55 5E 04"));
  CHECK(absolute("K10CR1", 90) == hex("53 04 06 00 D0 01 01 00 00 80 BB 00"));
  // 0.3 x 550292.68 = 165088, 0.4 x 187.83 = 75
  CHECK(velocity("Z612", 0.3, 0.4) ==
        hex("13 04 0E 00 D0 01 01 00 00 00 00 00 4B 00 00 00 E0 84 02 00"));
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
