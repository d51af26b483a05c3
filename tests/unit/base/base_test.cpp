#include <catch2/catch.hpp>

#include "protocols/base/bytes.hpp"
#include "protocols/base/names.hpp"
#include "protocols/base/phase.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace base_test {

using namespace weft;

namespace {
Bytes ascii(std::string_view text) {
  return {text.begin(), text.end()};
}
}  // namespace

TEST_CASE("CRCs give the catalogue's check values") {
  CHECK(crc16_ccitt(ascii("123456789")) == 0x29B1);
  CHECK(crc16_modbus(ascii("123456789")) == 0x4B37);
  CHECK(crc32(ascii("123456789")) == 0xCBF43926U);
  CHECK(crc32(ascii("6789"), crc32(ascii("12345"))) == 0xCBF43926U);
}

TEST_CASE("CRC-16 does not depend on how bytes are cut") {
  Bytes bytes;
  for (unsigned i = 0; i < 45; ++i) bytes.push_back(static_cast<std::uint8_t>(i * i + 7 * i));
  std::uint16_t one_by_one = 0xFFFF;
  for (const std::uint8_t& byte : bytes) one_by_one = crc16_ccitt({&byte, 1}, one_by_one);
  CHECK(crc16_ccitt(bytes) == one_by_one);
}

TEST_CASE("a CRC-32 does not depend on where a text is cut, and is that of single bits") {
  Bytes text;
  for (unsigned i = 0; i < 61; ++i) text.push_back(static_cast<std::uint8_t>(i * i + 7 * i));
  const auto bit_by_bit = [](ByteView bytes) {
    std::uint32_t c = ~0U;
    for (const std::uint8_t b : bytes) {
      c ^= b;
      for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    }
    return ~c;
  };
  for (std::size_t length = 0; length <= text.size(); ++length) {
    const ByteView whole = ByteView(text).first(length);
    CHECK(crc32(whole) == bit_by_bit(whole));
    for (std::size_t cut = 0; cut <= length; ++cut)
      CHECK(crc32(whole.subspan(cut), crc32(whole.first(cut))) == crc32(whole));
  }
}

TEST_CASE("a reader that runs out turns bad and stays bad") {
  const Bytes three{1, 2, 3};
  LittleReader in(three);
  CHECK(in.read<std::uint16_t>() == 0x0201);
  CHECK(in.read<std::uint32_t>() == 0);
  CHECK_FALSE(in.ok());
  CHECK(in.read<std::uint8_t>() == 0);
}

TEST_CASE("signed and unsigned integers survive both byte orders at their bounds") {
  for (const std::int32_t v : {0, 1, -1, 0x7FFFFFFF, -0x7FFFFFFF - 1}) {
    Bytes little;
    Bytes big;
    LittleWriter(little).write(v);
    BigWriter(big).write(v);
    CHECK(LittleReader(little).read<std::int32_t>() == v);
    CHECK(BigReader(big).read<std::int32_t>() == v);
    CHECK(little == Bytes(big.rbegin(), big.rend()));
  }
}

TEST_CASE("an error reads as a sentence with its place in front") {
  Error e = Error{.code = Errc::range,
                  .where = "/speed_mm_s",
                  .what = "speed too high",
                  .expected = "<= 4",
                  .got = "5",
                  .hint = "Lower it"};
  CHECK(to_string(std::move(e).in("m1.json")) ==
        "m1.json: /speed_mm_s: speed too high: 5 (expected <= 4). Lower it.");
  CHECK(to_string(Error{.code = Errc::range,
                        .where = "rig",
                        .what = "Too high. Too low.",
                        .hint = "Look there."}) == "rig: Too high. Too low. Look there.");
  CHECK(to_string(Error{.code = Errc::range, .what = "too high", .hint = "Is it in mm?"}) ==
        "too high. Is it in mm?");
}

TEST_CASE("a place that an error has already is not repeated") {
  const Error there =
      Error{.code = Errc::io, .where = "a.sqlite", .what = "no room"}.in("a.sqlite");
  CHECK(there.where == "a.sqlite");
  CHECK(Error(there).in("run").in("run").where == "run: a.sqlite");
  CHECK(Error(there).in("a").where == "a: a.sqlite");
}

TEST_CASE("a table of names is read both ways, and an unknown name is refused with what is known") {
  enum class Colour { red, green, blue };
  constexpr NameTable<Colour, 2> colours = {{{Colour::green, "green"}, {Colour::red, "red"}}};
  CHECK(name_in(colours, Colour::red) == "red");
  CHECK(name_in(colours, Colour::blue) == "?");
  CHECK(value_in(colours, "green") == Colour::green);
  CHECK_FALSE(value_in(colours, "Green"));
  CHECK(values_of(colours) == std::vector{Colour::green, Colour::red});
  CHECK(value_from(colours, "red", "no such colour", name_list(colours)) == Colour::red);
  const auto none = value_from(colours, "blue", "no such colour", name_list(colours));
  CHECK(none.error().code == Errc::invalid_argument);
  CHECK(none.error().expected == "green, red");
  CHECK(none.error().got == "blue");
}

TEST_CASE("seconds round to the nearest nanosecond") {
  CHECK(from_seconds(1e-9) == Duration(1));
  CHECK(from_seconds(-0.25) == Duration(-250000000));
  CHECK(to_seconds(from_seconds(36.2)) == Approx(36.2));
}

TEST_CASE("phase letters go both ways and others are refused") {
  for (const Phase p : {Phase::none, Phase::rest, Phase::press, Phase::motion, Phase::end})
    CHECK(phase_from_char(to_char(p)) == p);
  CHECK_FALSE(phase_from_char('X').has_value());
}

}  // namespace base_test
