#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>

#include "daemon/service/lab/lab_schema.hpp"
#include "daemon/service/lab/lab_store.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace weft::daemon::test::lab_address {

using namespace lab;

/// Sets one variable of the environment, or unsets it, until the end of the scope.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    set(value);
  }
  ~Variable() { set(before_ ? before_->c_str() : nullptr); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  void set(const char* value) const {
    value == nullptr ? ::unsetenv(name_) : ::setenv(name_, value, 1);
  }
  const char* name_;
  std::optional<std::string> before_;
};

/// No variable of libpq.
struct CleanEnvironment {
  Variable mode{"PGSSLMODE", nullptr}, host{"PGHOST", nullptr}, port{"PGPORT", nullptr},
      user{"PGUSER", nullptr}, database{"PGDATABASE", nullptr};
};

TEST_CASE("a lab address over TCP is verified in full by default") {
  const CleanEnvironment clean;
  const auto address =
      LabAddress::parse("postgresql://ada@db.example:5433/lab?sslrootcert=/ca.pem");
  REQUIRE(address);
  CHECK(address->host == "db.example");
  CHECK(address->port == "5433");
  CHECK(address->user == "ada");
  CHECK(address->database == "lab");
  CHECK(address->ca_file == "/ca.pem");
  CHECK(address->tls == TlsCheck::verify_full);
  CHECK_FALSE(address->is_local());
  CHECK(address->text() == "postgresql://ada@db.example:5433/lab");
  CHECK(LabAddress::parse("postgres://ada@[::1]/lab")->text() == "postgresql://ada@[::1]:5432/lab");
  CHECK(LabAddress::parse("postgresql://ada@db/lab?sslmode=verify-ca")->tls == TlsCheck::verify_ca);
}

TEST_CASE("a lab address refuses modes of TLS that do not verify the server") {
  const CleanEnvironment clean;
  for (const char* const mode : {"disable", "allow", "prefer", "require", "nonsense"}) {
    const auto stated = LabAddress::parse(std::string("postgresql://ada@db/lab?sslmode=") + mode);
    REQUIRE_FALSE(stated);
    CHECK(stated.error().code == Errc::invalid_argument);
    CHECK(stated.error().expected == "verify-full or verify-ca");
    const Variable weak("PGSSLMODE", mode);
    const auto inherited = LabAddress::parse("postgresql://ada@db/lab");
    REQUIRE_FALSE(inherited);
    CHECK(inherited.error().where == "PGSSLMODE");
    CHECK(LabAddress::parse("postgresql://ada@db/lab?sslmode=verify-full"));
    CHECK(LabAddress::parse("postgresql://ada@/lab?host=/run/postgresql"));
  }
}

TEST_CASE("a lab address has no password, and no error repeats one") {
  const CleanEnvironment clean;
  for (const char* const uri :
       {"postgresql://ada:hunter2@db/lab", "postgresql://ada@db/lab?password=hunter2",
        "postgresql://ada@db/lab?sslpassword=hunter2", "postgresql://ada:hun/hunter2@db/lab",
        "postgresql://ada@db/lab?passwrd=hunter2", "postgresql://ada:hunter2@db:x:y/lab?a=b=c",
        "postgresql://ada@db:hunter2/lab", "postgresql://ada@db,hunter2/lab",
        "postgresql://ada@[hunter2/lab", "postgresql://ada@db/hunter2@db",
        "host=db password=hunter2", "hunter2"}) {
    const auto refused = LabAddress::parse(uri);
    INFO(uri);
    REQUIRE_FALSE(refused);
    CHECK(to_string(refused.error()).find("hunter2") == std::string::npos);
  }
  const auto refused = LabAddress::parse("postgresql://ada:hunter2@db/lab");
  CHECK(refused.error().what == "URI has a password");
  CHECK(refused.error().hint.find("PGPASSFILE") != std::string::npos);
}

TEST_CASE("a lab address takes absent parts from the environment") {
  const CleanEnvironment clean;
  const auto plain = LabAddress::parse("postgresql://");
  REQUIRE(plain);
  CHECK(plain->is_local());
  CHECK(plain->port == "5432");
  CHECK(plain->database == plain->user);
  const Variable host("PGHOST", "db.example"), user("PGUSER", "ada"), port("PGPORT", "6000");
  const auto found = LabAddress::parse("postgresql:///lab");
  REQUIRE(found);
  CHECK(found->text() == "postgresql://ada@db.example:6000/lab");
  CHECK(LabAddress::parse("postgresql://%2Frun%2Fpg/lab")->host == "/run/pg");
  CHECK_FALSE(LabAddress::parse("postgresql://ada@db/lab?options=-csearch_path"));
  CHECK_FALSE(LabAddress::parse("postgresql://ada@db/lab?service=other"));
}

TEST_CASE("a store that is not there or gives no reply is an error within the limits") {
  const CleanEnvironment clean;
  const TemporaryFolder folder;
  const auto address = LabAddress::parse("postgresql://ada@/lab?host=" + folder.path().string());
  REQUIRE(address);
  const auto absent = LabStore::open(*address, "test");
  REQUIRE_FALSE(absent);
  CHECK(absent.error().code == Errc::io);
  CHECK(absent.error().what == "laboratory's store not reachable");

  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  const std::string path = (folder.path() / ".s.PGSQL.5432").string();
  REQUIRE(path.size() < sizeof at.sun_path);
  std::memcpy(at.sun_path, path.c_str(), path.size());
  REQUIRE(::bind(listener, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0);
  REQUIRE(::listen(listener, 1) == 0);
  const auto silent = LabStore::open(*address, "test", {.connect = std::chrono::seconds(2)});
  REQUIRE_FALSE(silent);
  CHECK(silent.error().code == Errc::io);
  CHECK(silent.error().got.find("timeout") != std::string::npos);
  ::close(listener);
}

TEST_CASE("migrations of the store are numbered without gaps, and roles come first") {
  int version = 0;
  for (const Migration& each : migrations()) {
    CHECK(each.version == version++);
    CHECK(each.sql.size() > 100);
  }
  CHECK(version >= 2);
}

TEST_CASE("a lab campaign's id is read as it is written") {
  CHECK(campaign_text(12) == "C-000012");
  CHECK(campaign_number("C-000012") == 12);
  CHECK(campaign_number("12") == 12);
  for (const char* const text : {"", "C-", "C-x", "-1", "0", "12 ", "R-000012"})
    CHECK_FALSE(campaign_number(text));
}

TEST_CASE("bound arrays quote what PostgreSQL would read as syntax") {
  CHECK(*bound(std::vector<std::string>{}) == "{}");
  CHECK(*bound(std::vector<std::string>{"a,b", "c\"d", "e\\f", "{}", "", "NULL"}) ==
        R"({"a,b","c\"d","e\\f","{}","","NULL"})");
  CHECK(*bound(std::vector<std::int64_t>{1, -2}) == R"({"1","-2"})");
  CHECK_FALSE(bound(std::optional<std::int64_t>()));
  CHECK(*bound(true) == "t");
}

}  // namespace weft::daemon::test::lab_address
