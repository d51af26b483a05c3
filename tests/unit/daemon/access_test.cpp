// Leases, keys against doing things twice, and tokens.

#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "daemon/access/idempotency.hpp"
#include "daemon/access/leases.hpp"
#include "daemon/access/tokens.hpp"
#include "tests/unit/daemon/trial_bench.hpp"

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::access;
using namespace std::chrono_literals;

namespace {

Leases::Asked asked(const std::string& user, std::chrono::milliseconds ttl = 15s) {
  return {"rig:bench", user, "s-1", "denim batch", ttl};
}

}  // namespace

TEST_CASE("One user holds a rig at a time, and is named to the others") {
  Leases leases;
  const auto mine = leases.acquire(asked("ada"), 0s);
  REQUIRE(mine);
  const auto other = leases.acquire(asked("bob"), 1s);
  REQUIRE_FALSE(other);
  CHECK_THAT(to_string(other.error()), Catch::Contains("ada") && Catch::Contains("denim batch"));
  CHECK(leases.release(mine->id, "ada", 2s));
  CHECK(leases.acquire(asked("bob"), 3s));
}

TEST_CASE("A lease ends by itself unless it is renewed") {
  Leases leases;
  const auto lease = leases.acquire(asked("ada"), 0s);
  CHECK(leases.renew(lease->id, "ada", 15s, 14s));
  CHECK(leases.check(lease->id, "rig:bench", "ada", 28s));
  CHECK_FALSE(leases.check(lease->id, "rig:bench", "ada", 29s));
  CHECK(leases.expire(29s).size() == 1);
  CHECK(leases.acquire(asked("bob"), 29s));
}

TEST_CASE("Nobody uses, renews or releases somebody else's lease") {
  Leases leases;
  const auto lease = leases.acquire(asked("ada"), 0s);
  CHECK(leases.check(lease->id, "rig:bench", "bob", 1s).error().code == Errc::wrong_state);
  CHECK(leases.check(lease->id, "rig:other", "ada", 1s).error().code == Errc::wrong_state);
  CHECK_FALSE(leases.renew(lease->id, "bob", 15s, 1s));
  CHECK_FALSE(leases.release(lease->id, "bob", 1s));
  CHECK(leases.check("L-99", "rig:bench", "ada", 1s).error().code == Errc::not_found);
}

TEST_CASE("Breaking a lease needs a reason, and times to live have their limits") {
  Leases leases;
  const auto lease = leases.acquire(asked("ada"), 0s);
  CHECK_FALSE(leases.break_lease(lease->id, "", 1s));
  CHECK(leases.break_lease(lease->id, "ada has left", 1s));
  CHECK(leases.acquire(asked("bob", 1ms), 2s).error().code == Errc::range);
  CHECK(leases.acquire(asked("bob", 2h), 2s).error().code == Errc::range);
}

TEST_CASE("A change that is asked for twice with one key is answered twice and done once") {
  using Found = IdempotencyCache::Found;
  IdempotencyCache cache;
  CHECK(cache.look("ada", "k1", "start A").found == Found::fresh);
  CHECK(cache.look("ada", "k1", "start A").found == Found::under_way);
  cache.answered("ada", "k1", rpc::Outcome("{\"run\":1}"));
  const auto again = cache.look("ada", "k1", "start A");
  REQUIRE(again.found == Found::answered);
  CHECK(**again.outcome == "{\"run\":1}");
  CHECK(cache.look("ada", "k1", "start B").found == Found::other_request);
  CHECK(cache.look("bob", "k1", "start A").found == Found::fresh);
  CHECK(cache.look("ad", "ak1", "start A").found == Found::fresh);
}

TEST_CASE("A refusal that may pass is not kept: the next try is a new one") {
  using Found = IdempotencyCache::Found;
  IdempotencyCache cache;
  static_cast<void>(cache.look("ada", "k", "x"));
  cache.answered("ada", "k", tl::unexpected(rpc::rpc_error(3000, "state.conflict", {}, true)));
  CHECK(cache.look("ada", "k", "x").found == Found::fresh);
  cache.answered("ada", "k", tl::unexpected(rpc::rpc_error(1012, "param.range", {}, false)));
  CHECK(cache.look("ada", "k", "x").found == Found::answered);
}

TEST_CASE("A token is good until it expires, and its file holds only its digest") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto tokens = TokenFile::load(file);
  REQUIRE(tokens);
  const auto token = tokens->add("notebook", Role::operator_, 1000);
  REQUIRE(token);
  REQUIRE(tokens->save());
  struct stat found {};
  REQUIRE(stat(file.c_str(), &found) == 0);
  CHECK((found.st_mode & 0777) == 0600);
  std::ifstream in(file);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  CHECK(text.find(*token) == std::string::npos);
  const auto again = TokenFile::load(file);
  REQUIRE(again);
  CHECK(again->find(*token, 999)->role == Role::operator_);
  CHECK_FALSE(again->find(*token, 1000));
  CHECK_FALSE(again->find(*token + "0", 999));
  CHECK_FALSE(again->find("", 999));
}

TEST_CASE("The name of a token whose time is over is free again") {
  auto tokens = TokenFile::load("/nowhere/tokens.json");
  REQUIRE(tokens);
  REQUIRE(tokens->add("early", Role::observer, 1000));
  REQUIRE(tokens->add("late", Role::observer, 2000));
  CHECK_FALSE(tokens->add("early", Role::observer, 3000));
  tokens->forget_expired(1000);
  CHECK(tokens->entries().size() == 1);
  CHECK(tokens->add("early", Role::observer, 3000));
  CHECK_FALSE(tokens->add("late", Role::observer, 3000));
}

TEST_CASE("A file of tokens that others may read is refused") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto tokens = TokenFile::load(file);
  REQUIRE(tokens->add("notebook", Role::observer, 1000));
  REQUIRE(tokens->save());
  REQUIRE(chmod(file.c_str(), 0644) == 0);
  CHECK(TokenFile::load(file).error().code == Errc::wrong_state);
  REQUIRE(chmod(file.c_str(), 0600) == 0);
  const auto link = folder.path() / "link.json";
  std::filesystem::create_symlink(file, link);
  CHECK_FALSE(TokenFile::load(link));
}
