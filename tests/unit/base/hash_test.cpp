// Hashes of texts that are used for seeds: these must never change.

#include "protocols/base/hash.hpp"

#include <catch2/catch.hpp>

namespace weft::hash_test {
namespace {

TEST_CASE("Hashes are those of their papers") {
  CHECK(fnv1a("") == 0xcbf29ce484222325);  // the test vectors of Fowler, Noll and Vo
  CHECK(fnv1a("a") == 0xaf63dc4c8601ec8c);
  CHECK(fnv1a("foobar") == 0x85944171f73967e8);
  CHECK(fnv1a("\xff") != fnv1a("\x7f"));
  // The first number of splitmix64 from state 0.
  CHECK(splitmix64_finish(splitmix64_gamma) == 0xe220a8397b1dcdaf);
  CHECK(seed_of("foobar") == splitmix64_finish(0x85944171f73967e8 + splitmix64_gamma));
}

}  // namespace
}  // namespace weft::hash_test
