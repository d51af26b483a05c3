// Leases, idempotency keys, and tokens.

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>

#include "daemon/service/rpc/idempotency.hpp"
#include "daemon/service/rpc/leases.hpp"
#include "daemon/service/rpc/rate_limits.hpp"
#include "daemon/service/rpc/tokens.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace access_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::access;
using namespace std::chrono_literals;

namespace {

Leases::Request requested(const std::string& user, std::chrono::milliseconds ttl = 15s) {
  return {"rig:bench", user, "s-1", "denim batch", ttl};
}

}  // namespace

TEST_CASE("One user holds a rig at a time, and is named to the others") {
  Leases leases("9c1d40b2");
  const auto mine = leases.acquire(requested("ada"), 0s);
  REQUIRE(mine);
  const auto other = leases.acquire(requested("bob"), 1s);
  REQUIRE_FALSE(other);
  CHECK_THAT(other.error().got, Catch::Contains("ada") && Catch::Contains("denim batch"));
  CHECK(leases.release(mine->id, "ada", 2s));
  CHECK(leases.acquire(requested("bob"), 3s));
}

TEST_CASE("A lease of an earlier start of the daemon is invalid") {
  Leases earlier("9c1d40b2"), now("07aa51de");
  const auto then = earlier.acquire(requested("ada"), 0s);
  REQUIRE(now.acquire(requested("ada"), 1s));
  CHECK(now.check(then->id, "rig:bench", "ada", 2s).error().code == Errc::not_found);
  CHECK_FALSE(now.release(then->id, "ada", 2s));
}

TEST_CASE("A lease ends by itself unless it is renewed") {
  Leases leases("9c1d40b2");
  const auto lease = leases.acquire(requested("ada"), 0s);
  CHECK(leases.renew(lease->id, "ada", 15s, 14s));
  CHECK(leases.check(lease->id, "rig:bench", "ada", 28s));
  CHECK_FALSE(leases.check(lease->id, "rig:bench", "ada", 29s));
  CHECK(leases.expire(29s).size() == 1);
  CHECK(leases.acquire(requested("bob"), 29s));
}

TEST_CASE("A renewal is worth a line of the journal where it adds a second to what is there") {
  Leases leases("9c1d40b2");
  const auto lease = leases.acquire(requested("ada"), 0s);
  REQUIRE(leases.renew(lease->id, "ada", 15s, 900ms));
  CHECK_FALSE(leases.should_journal(lease->id));
  REQUIRE(leases.renew(lease->id, "ada", 15s, 1100ms));
  CHECK(leases.should_journal(lease->id));
  CHECK_FALSE(leases.should_journal(lease->id));
}

TEST_CASE("A user over the rate limit waits for the bucket to fill, and no other user does") {
  RateLimits rates;
  for (std::size_t i = 0; i < RateLimits::burst; ++i) REQUIRE(rates.take("ada", 1s));
  CHECK_FALSE(rates.take("ada", 1s));
  CHECK(rates.take("bob", 1s));
  CHECK(rates.take("ada", 1s + 1ms));
  for (std::size_t i = 1; i < RateLimits::per_second / 1000; ++i)
    REQUIRE(rates.take("ada", 1s + 1ms));
  CHECK_FALSE(rates.take("ada", 1s + 1ms));
  for (std::size_t i = 0; i < RateLimits::most_known; ++i)
    REQUIRE(rates.take(std::to_string(i), 2s));
  CHECK(rates.take("bob", 2s));  // his entry was dropped, without a disadvantage
}

TEST_CASE("A lease is kept while the run of its user is under way, released or not") {
  Leases leases("9c1d40b2");
  const auto of_ada = requested("ada");
  const bool had_lease = GENERATE(true, false);
  std::string id;
  if (had_lease) {
    id = leases.acquire(of_ada, 0s)->id;
    CHECK(leases.keep("R-000001", of_ada, 1s)->id == id);
    REQUIRE(leases.release(id, "ada", 2s));
  } else {
    id = leases.keep("R-000001", of_ada, 1s)->id;
  }
  CHECK_FALSE(leases.keep("R-000001", of_ada, 3s));  // it is kept already
  CHECK(leases.expire(100s).empty());
  CHECK_FALSE(leases.holder("rig:bench", 100s));  // no user is in control
  CHECK(leases.all(100s).size() == 1);
  CHECK(leases.acquire(requested("bob"), 100s).error().code == Errc::wrong_state);
  const auto again = leases.acquire(of_ada, 100s);
  REQUIRE(again);
  CHECK(again->id == id);
  CHECK(leases.holder("rig:bench", 101s)->id == id);
  CHECK(leases.kept_for("R-000001")->user == "ada");
  CHECK(leases.end_keeping("R-000001", 101s)->id == id);
  CHECK_FALSE(leases.end_keeping("R-000001", 101s));
  CHECK(leases.expire(116s).size() == 1);
  CHECK(leases.acquire(requested("bob"), 116s));
}

TEST_CASE("A run keeps a lease of its own beside another user's, which breaking ends") {
  Leases leases("9c1d40b2");
  REQUIRE(leases.acquire(requested("bob"), 0s));
  const auto kept = leases.keep("R-000001", requested("ada"), 1s);
  REQUIRE(kept);
  CHECK(leases.holder("rig:bench", 2s)->user == "bob");
  CHECK(leases.kept_for("R-000001")->user == "ada");
  REQUIRE(leases.break_lease(kept->id, "ada has left", 3s));
  CHECK_FALSE(leases.kept_for("R-000001"));
  CHECK_FALSE(leases.keep("R-000001", requested("ada"), 4s));  // that run has no lease any longer
  CHECK_FALSE(leases.end_keeping("R-000001", 5s));
  CHECK(leases.keep("R-000002", requested("ada"), 6s));
  REQUIRE(leases.end_keeping("R-000002", 7s));
  CHECK(leases.all(7s).size() == 1);  // it was only kept, and ended with its run
}

TEST_CASE("A lease of another user cannot be used, renewed or released") {
  Leases leases("9c1d40b2");
  const auto lease = leases.acquire(requested("ada"), 0s);
  CHECK(leases.check(lease->id, "rig:bench", "bob", 1s).error().code == Errc::wrong_state);
  CHECK(leases.check(lease->id, "rig:other", "ada", 1s).error().code == Errc::wrong_state);
  CHECK_FALSE(leases.renew(lease->id, "bob", 15s, 1s));
  CHECK_FALSE(leases.release(lease->id, "bob", 1s));
  CHECK(leases.check("L-99", "rig:bench", "ada", 1s).error().code == Errc::not_found);
}

TEST_CASE("Breaking a lease needs a reason, and times to live have their limits") {
  Leases leases("9c1d40b2");
  const auto lease = leases.acquire(requested("ada"), 0s);
  CHECK_FALSE(leases.break_lease(lease->id, "", 1s));
  CHECK(leases.break_lease(lease->id, "ada has left", 1s));
  CHECK(leases.acquire(requested("bob", 1ms), 2s).error().code == Errc::range);
  CHECK(leases.acquire(requested("bob", 2h), 2s).error().code == Errc::range);
}

TEST_CASE("A change that is asked for twice with one key is answered twice and done once") {
  using Found = IdempotencyCache::Found;
  IdempotencyCache cache;
  CHECK(cache.lookup("ada", "k1", "start A").found == Found::fresh);
  CHECK(cache.lookup("ada", "k1", "start A").found == Found::under_way);
  cache.answered("ada", "k1", rpc::Outcome("{\"run\":1}"));
  const auto again = cache.lookup("ada", "k1", "start A");
  REQUIRE(again.found == Found::answered);
  CHECK(**again.outcome == "{\"run\":1}");
  CHECK(cache.lookup("ada", "k1", "start B").found == Found::other_request);
  CHECK(cache.lookup("bob", "k1", "start A").found == Found::fresh);
  CHECK(cache.lookup("ad", "ak1", "start A").found == Found::fresh);
}

TEST_CASE("A refusal that may pass is not kept: the next try is a new one") {
  using Found = IdempotencyCache::Found;
  IdempotencyCache cache;
  static_cast<void>(cache.lookup("ada", "k", "x"));
  cache.answered("ada", "k", tl::unexpected(rpc::rpc_error(3000, "state.conflict", {}, true)));
  CHECK(cache.lookup("ada", "k", "x").found == Found::fresh);
  cache.answered("ada", "k", tl::unexpected(rpc::rpc_error(1012, "param.range", {}, false)));
  CHECK(cache.lookup("ada", "k", "x").found == Found::answered);
}

TEST_CASE("Answers outlive the daemon for a while; one that it never gave is reported as unknown") {
  using Found = IdempotencyCache::Found;
  std::vector<StoredAnswer> disk;
  std::int64_t now_us = 0;
  const auto of = [&](const std::string& name) {
    return std::ranges::find(disk, name, &StoredAnswer::name);
  };
  const AnswerMemory memory{
      .utc_us = [&] { return now_us; },
      .requested = [&](const StoredAnswer& one) { disk.push_back(one); },
      .answered = [&](const std::string& name,
                      const rpc::Outcome& outcome) { of(name)->outcome = outcome; },
      .forgotten = [&](const std::string& name) { disk.erase(of(name)); }};
  IdempotencyCache first;
  first.remember_in(memory, {});
  CHECK(first.lookup("ada", "done", "A").found == Found::fresh);
  first.answered("ada", "done", rpc::Outcome("1"));
  CHECK(first.lookup("ada", "refused", "A").found == Found::fresh);
  first.answered("ada", "refused", tl::unexpected(rpc::rpc_error(1012, "param.range", {})));
  CHECK(first.lookup("ada", "later", "A").found == Found::fresh);
  first.answered("ada", "later", tl::unexpected(rpc::rpc_error(3000, "busy", {}, true)));
  CHECK(first.lookup("ada", "cut", "A").found == Found::fresh);
  CHECK(first.lookup("ada", "secret", "A", false).found == Found::fresh);
  first.answered("ada", "secret", rpc::Outcome("wft_0"));
  CHECK(disk.size() == 3);

  IdempotencyCache second;
  second.remember_in(memory, disk);
  CHECK(**second.lookup("ada", "done", "A").outcome == "1");
  CHECK(second.lookup("ada", "done", "B").found == Found::other_request);
  CHECK(second.lookup("ada", "refused", "A").outcome->error().kind == "param.range");
  CHECK(second.lookup("ada", "cut", "A").found == Found::cut_short);
  CHECK(second.lookup("ada", "later", "A").found == Found::fresh);
  now_us = std::chrono::microseconds(IdempotencyCache::longest_stored).count() + 1;
  CHECK(second.lookup("ada", "done", "A").found == Found::fresh);
  CHECK(disk.size() == 1);
}

TEST_CASE("An answer that is on the disk takes no memory, and is read on request") {
  using Found = IdempotencyCache::Found;
  std::optional<rpc::Outcome> disk;
  const AnswerMemory memory{
      .utc_us = {},
      .requested = {},
      .answered = [&](const std::string&, const rpc::Outcome& outcome) { disk = outcome; },
      .forgotten = {},
      .load = [&](const std::string&) { return disk; }};
  IdempotencyCache cache;
  cache.remember_in(memory, {});
  CHECK(cache.lookup("ada", "k", "A").found == Found::fresh);
  CHECK(cache.lookup("ada", "k", "A").found == Found::under_way);
  cache.answered("ada", "k", rpc::Outcome("1"));
  CHECK(**cache.lookup("ada", "k", "A").outcome == "1");
  disk = rpc::Outcome("2");
  CHECK(**cache.lookup("ada", "k", "A").outcome == "2");  // so it was not kept in memory
  CHECK(cache.lookup("ada", "k", "B").found == Found::other_request);
  disk.reset();
  CHECK(cache.lookup("ada", "k", "A").found == Found::cut_short);
  CHECK(cache.lookup("ada", "secret", "A", false).found == Found::fresh);
  cache.answered("ada", "secret", rpc::Outcome("wft_0"));  // not stored on disk
  CHECK(**cache.lookup("ada", "secret", "A", false).outcome == "wft_0");
}

TEST_CASE("The oldest answers make room, on the disk too") {
  std::size_t saved = 0;
  IdempotencyCache cache;
  cache.remember_in({.utc_us = {},
                     .requested = [&](const StoredAnswer&) { ++saved; },
                     .answered = {},
                     .forgotten = [&](const std::string&) { --saved; }},
                    {});
  for (std::size_t i = 0; i < IdempotencyCache::most_stored + 10; ++i)
    static_cast<void>(cache.lookup("ada", std::to_string(i), "A"));
  CHECK(saved == IdempotencyCache::most_stored);
  CHECK(cache.lookup("ada", "0", "A").found == IdempotencyCache::Found::fresh);
}

TEST_CASE("Keys of one user do not displace those of another, also after a restart") {
  using Found = IdempotencyCache::Found;
  std::vector<StoredAnswer> disk;
  const AnswerMemory memory{.utc_us = {},
                            .requested = [&](const StoredAnswer& one) { disk.push_back(one); },
                            .answered =
                                [&](const std::string& name, const rpc::Outcome& outcome) {
                                  std::ranges::find(disk, name, &StoredAnswer::name)->outcome =
                                      outcome;
                                },
                            .forgotten = {}};
  // A token with its own user, or one that acts for its maker.
  const auto [user, token] = GENERATE(
      table<std::string, std::string>({{"token:looks-on", "looks-on"}, {"ada", "looks-on"}}));
  const bool persistent = GENERATE(false, true);
  const auto flood = [&, user = user, token = token](IdempotencyCache& cache,
                                                     const std::string& prefix) {
    for (std::size_t i = 0; i <= IdempotencyCache::most_stored; ++i)
      static_cast<void>(cache.lookup(user, prefix + std::to_string(i), "close", persistent, token));
  };
  IdempotencyCache first;
  first.remember_in(memory, {});
  CHECK(first.lookup("ada", "k", "start").found == Found::fresh);
  first.answered("ada", "k", rpc::Outcome("{\"run\":1}"));
  flood(first, "a");
  REQUIRE(first.lookup("ada", "k", "start").found == Found::answered);
  IdempotencyCache second;
  second.remember_in(memory, disk);
  flood(second, "b");
  CHECK(second.lookup("ada", "k", "start").found == Found::answered);
  CHECK(second.lookup(user, "b" + std::to_string(IdempotencyCache::most_stored), "close").found ==
        Found::under_way);  // the keys belong to one user for all connections
}

TEST_CASE("A refusal that was kept as text is the same again") {
  const rpc::RpcError error = rpc::rpc_error(rpc::code::state, "state.conflict",
                                             {.code = Errc::wrong_state,
                                              .where = "/here",
                                              .what = "not now",
                                              .expected = "a",
                                              .got = "b",
                                              .hint = "c"});
  CHECK(to_json(rpc::error_from_json(to_json(error))) == to_json(error));
  CHECK(rpc::error_from_json("{").kind == "internal");
}

TEST_CASE("A change of the tokens locks them, and a caller that does not wait gets an error") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  const auto add_one = [](TokenFile& tokens) -> Status {
    const auto made = tokens.add("inner", Role::observer, 1000);
    return made ? Status{} : pass(made.error());
  };
  const Status outer = TokenFile::change(file, TokenFile::Wait::until_free, [&](TokenFile& tokens) {
    CHECK(TokenFile::change(file, TokenFile::Wait::not_at_all, add_one).error().code ==
          Errc::wrong_state);
    return add_one(tokens);
  });
  REQUIRE(outer);
  CHECK(TokenFile::load(file)->entries().size() == 1);
  CHECK(TokenFile::change(file, TokenFile::Wait::not_at_all, add_one).error().code ==
        Errc::invalid_argument);
}

TEST_CASE(
    "Tokens are known as their file has them now, and one that cannot be used changes nothing") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto keeper = TokenKeeper::open(file);
  REQUIRE(keeper);
  std::string token;
  REQUIRE(TokenFile::change(file, TokenFile::Wait::until_free, [&](TokenFile& tokens) -> Status {
    token = tokens.add("notebook", Role::operator_, 1000).value();
    return {};
  }));
  const auto found = keeper->find(token, 1);
  REQUIRE(found);
  CHECK(keeper->is_valid(*found, 999));
  CHECK_FALSE(keeper->is_valid(*found, 1000));
  REQUIRE(chmod(file.c_str(), 0644) == 0);
  CHECK(keeper->find(token, 1));
  std::filesystem::remove(file);
  keeper->refresh();
  CHECK_FALSE(keeper->is_valid(*found, 1));
  CHECK(keeper->add("another", Role::admin, 1000, {}, 1));
}

TEST_CASE("A token acts for its own owner, or for whoever it was made for, over restarts too") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto tokens = TokenFile::load(file);
  REQUIRE(tokens);
  const auto others = tokens->add("ada", Role::operator_, 1000);
  const auto own = tokens->add("ada-2", Role::observer, 1000, "ada");
  REQUIRE((others && own));
  REQUIRE(tokens->save());
  const auto again = TokenFile::load(file);
  REQUIRE(again);
  CHECK(user_of(*again->find(*others, 1)) == "token:ada");
  CHECK(user_of(*again->find(*own, 1)) == "ada");
  CHECK(again->find(*own, 1)->role == Role::observer);
}

TEST_CASE("An unreadable token file is reported, and read again as soon as possible") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto tokens = TokenFile::load(file);
  REQUIRE(tokens);
  const auto token = tokens->add("notebook", Role::operator_, 1000);
  REQUIRE(token);
  REQUIRE(tokens->save());
  auto keeper = TokenKeeper::open(file);
  REQUIRE(keeper);
  const auto found = keeper->find(*token, 1);
  REQUIRE(found);
  REQUIRE(tokens->remove("notebook"));
  REQUIRE(tokens->save());
  rlimit descriptors{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &descriptors) == 0);
  const rlimit none{0, descriptors.rlim_max};
  REQUIRE(setrlimit(RLIMIT_NOFILE, &none) == 0);
  keeper->refresh();
  REQUIRE(setrlimit(RLIMIT_NOFILE, &descriptors) == 0);
  CHECK(keeper->is_valid(*found, 1));
  REQUIRE(keeper->problem());
  CHECK_THAT(keeper->problem()->where, Catch::Contains("tokens.json"));
  keeper->refresh();
  CHECK_FALSE(keeper->problem());
  CHECK_FALSE(keeper->is_valid(*found, 1));
}

TEST_CASE("A removed token is invalid, and an unknown name is refused with the known names") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto keeper = TokenKeeper::open(file);
  REQUIRE(keeper);
  const auto token = keeper->add("notebook", Role::operator_, 1000, {}, 1);
  REQUIRE(token);
  REQUIRE(keeper->add("ada", Role::admin, 1000, {}, 1));
  const Status unknown = keeper->remove("bob");
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().code == Errc::not_found);
  CHECK(unknown.error().expected == "notebook, ada");
  REQUIRE(keeper->remove("notebook"));
  CHECK_FALSE(keeper->find(*token, 1));
  CHECK(TokenFile::load(file)->entries().size() == 1);
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

TEST_CASE("The name of an expired token is free again") {
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

TEST_CASE("The name of a token is no option of a command, and its file has each key once") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "tokens.json";
  auto tokens = TokenFile::load(file);
  for (const char* name : {"", "-rf", ".hidden", "a\nb"})
    CHECK(tokens->add(name, Role::observer, 1000).error().code == Errc::invalid_argument);
  REQUIRE(tokens->add("Zo\u00eb's notebook", Role::observer, 1000));
  REQUIRE(tokens->save());
  std::string twice = test::read_file(file);
  twice.insert(twice.find("\"role\""), "\"role\": \"admin\", ");
  test::write_file(file, twice);
  CHECK(TokenFile::load(file).error().where == file.string() + ": /tokens/0/role");
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

}  // namespace access_test
