#include <catch2/catch.hpp>

#include "daemon/base/file/sha256.hpp"

namespace sha256_test {

using namespace weft::daemon;

TEST_CASE("SHA-256 gives the examples of FIPS 180-4 and NIST's million a") {
  CHECK(sha256_hex("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  CHECK(sha256_hex(std::string(1000000, 'a')) ==
        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("SHA-256 pads messages that end around a block's border as Python's hashlib does") {
  const std::vector<std::pair<std::size_t, std::string>> cases{
      {55, "463eb28e72f82e0a96c0a4cc53690c571281131f672aa229e0d45ae59b598b59"},
      {56, "da2ae4d6b36748f2a318f23e7ab1dfdf45acdc9d049bd80e59de82a60895f562"},
      {63, "29af2686fd53374a36b0846694cc342177e428d1647515f078784d69cdb9e488"},
      {64, "fdeab9acf3710362bd2658cdc9a29e8f9c757fcf9811603a8c447cd1d9151108"},
      {65, "4bfd2c8b6f1eec7a2afeb48b934ee4b2694182027e6d0fc075074f2fabb31781"},
      {119, "da18797ed7c3a777f0847f429724a2d8cd5138e6ed2895c3fa1a6d39d18f7ec6"},
      {120, "f52b23db1fbb6ded89ef42a23ce0c8922c45f25c50b568a93bf1c075420bbb7c"},
      {127, "92ca0fa6651ee2f97b884b7246a562fa71250fedefe5ebf270d31c546bfea976"},
      {128, "471fb943aa23c511f6f72f8d1652d9c880cfa392ad80503120547703e56a2be5"},
  };
  for (const auto& [bytes, expected] : cases) {
    weft::Bytes message;
    for (std::size_t i = 0; i < bytes; ++i) message.push_back(static_cast<std::uint8_t>(i % 251));
    CHECK(to_hex(Sha256().update(message).finish()) == expected);
  }
}

TEST_CASE("SHA-256 does not depend on how a message is cut into pieces") {
  const std::string message(1000, 'x');
  for (const std::size_t step : {1U, 7U, 63U, 64U, 65U, 999U}) {
    Sha256 hash;
    for (std::size_t at = 0; at < message.size(); at += step)
      hash.text(std::string_view(message).substr(at, step));
    CHECK(to_hex(hash.finish()) == sha256_hex(message));
  }
}

TEST_CASE("numbers are hashed little-endian") {
  CHECK(to_hex(Sha256().number(std::uint32_t{0x64636261}).finish()) == sha256_hex("abcd"));
  const std::array<std::uint16_t, 2> pair{0x6261, 0x6463};
  CHECK(to_hex(Sha256().numbers(std::span<const std::uint16_t>(pair)).finish()) ==
        sha256_hex("abcd"));
}

TEST_CASE("SHA-256 takes an empty piece anywhere in a message") {
  CHECK(to_hex(Sha256().update({}).text("ab").text("").text("c").finish()) == sha256_hex("abc"));
}

}  // namespace sha256_test
