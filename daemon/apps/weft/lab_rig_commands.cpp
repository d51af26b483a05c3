// `weft lab accept` and `weft lab fetch`: a rig in its laboratory, and its files.

#include <curl/curl.h>
#include <poll.h>

#include <array>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/apps/weft/lab_text.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/service/lab/lab_store.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"

namespace weft::daemon::cli {
namespace {

namespace fs = std::filesystem;
using lab::LabStore;
using nlohmann::json;

struct AcceptArgs : SocketArgs {};

void add_options(CLI::App& command, AcceptArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
}

/// Holds the lease of the rig and accepts parts until a signal.
Result<int> run_accept(client::Client& daemon, const AcceptArgs&, Console& console) {
  constexpr std::chrono::milliseconds ttl{15000};
  constexpr int poll_ms = 100, polls = 30;  // renewed every 3 s
  const StopSignals signals(StopSignals::Hangup::stops, StopSignals::Suspend::allowed);
  const auto lease =
      call(daemon, "lease.acquire", {{"note", "weft lab accept"}, {"ttl_ms", ttl.count()}});
  if (!lease) return pass(lease.error());
  const json held{{"lease", lease->at("lease")}};
  auto status = call(daemon, "lab.accept", held);
  if (!status) return pass(status.error());
  console.err << "weft: " << status->value("rig", "") << " takes parts from "
              << status->value("store", "") << "; end with Ctrl-C" << std::endl;
  Status kept;
  for (int i = 1; kept && !signals.requested(); ++i) {
    ::poll(nullptr, 0, poll_ms);
    if (i % polls != 0) continue;
    const auto renewed =
        call(daemon, "lease.renew", {{"lease", held.at("lease")}, {"ttl_ms", ttl.count()}});
    if (!renewed) kept = pass(renewed.error());
  }
  if (!kept) return pass(kept.error());
  status = call(daemon, "lab.withdraw", json::object());
  static_cast<void>(call(daemon, "lease.release", held));
  if (!status) return pass(status.error());
  const json part = status->value("part", json());
  (*status)["command"] = "lab accept";
  print(console,
        part.is_object() ? "No further part is taken; " + part.value("fabric", "") + " goes on.\n"
                         : "No further part is taken.\n",
        *status);
  return exit_ok;
}

struct FetchArgs {
  std::string uri, what;
  fs::path out, token_file, tls_ca;
};

void add_options(CLI::App& command, FetchArgs& args) {
  command
      .add_option("WHAT", args.what,
                  "campaign C-000012, or the first digits of a data set's digest")
      ->required();
  command.add_option("--out", args.out, "write the data sets to this folder")->required();
  command.add_option("--lab", args.uri,
                     "connect to this store: postgresql://USER@HOST/DATABASE (or WEFT_LAB)");
  command.add_option("--token-file", args.token_file,
                     "read tokens from this file, a line RIG TOKEN for each (or WEFT_LAB_TOKENS)");
  command.add_option("--tls-ca", args.tls_ca,
                     "trust these CAs for the rigs (PEM); else the system's");
}

/// A data set of the store.
struct Wanted {
  std::string name;  ///< of its file: "denim"
  std::string rig, run, sha256;
  /// A copy of another rig will do. False: a simulated rig may have recorded the same samples as
  /// another one, but the file states which rig it was.
  bool from_any_rig = false;
};

/// Tokens by rig. Each goes to that rig only: any rig's login could publish an address of its own
/// to collect tokens of others.
using Tokens = std::map<std::string, std::string>;

Result<Tokens> read_tokens(const FetchArgs& args) {
  Tokens out;
  const fs::path file =
      args.token_file.empty() ? fs::path(from_environment("WEFT_LAB_TOKENS")) : args.token_file;
  if (file.empty()) return out;
  const auto text = read_text_file(file);
  if (!text) return pass(text.error());
  std::istringstream lines(*text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    std::string rig, token, more;
    if (!(words >> rig)) continue;
    if (!(words >> token) || words >> more)
      return fail({.code = Errc::parse,
                   .where = file.string() + ":" + std::to_string(number),
                   .what = "line is not a rig and its token",
                   .expected = "RIG TOKEN"});
    out[rig] = token;
  }
  return out;
}

/// Compares the digest in the file; each trial is compared when the file is read whole.
Status require_digest(const fs::path& file, const std::string& sha256) {
  const auto dataset = DatasetReader::open(file);
  if (!dataset) return pass(dataset.error());
  if (dataset->digest().dataset_sha256 == sha256) return {};
  return fail({.code = Errc::corrupt,
               .where = file.string(),
               .what = "data set is not the wanted one",
               .expected = sha256,
               .got = dataset->digest().dataset_sha256});
}

Status copy_file(const fs::path& from, const fs::path& to, const std::string& sha256) {
  if (Status same = require_digest(from, sha256); !same) return same;
  AtomicFile atomic(to);
  std::error_code error;
  fs::copy_file(from, atomic.temporary(), fs::copy_options::overwrite_existing, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = to.string(),
                 .what = "file not copied",
                 .got = error.message()});
  return atomic.publish();
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// GET of one file with the bearer token.
Status download(const std::string& url, const std::string& token, const fs::path& tls_ca,
                const fs::path& to) {
  static const CURLcode once = curl_global_init(CURL_GLOBAL_DEFAULT);
  static_cast<void>(once);
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> handle(curl_easy_init(),
                                                                   &curl_easy_cleanup);
  const std::string bearer = "Authorization: Bearer " + token;
  const std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)> headers(
      curl_slist_append(nullptr, bearer.c_str()), &curl_slist_free_all);
  const auto set = [&](CURLoption option, auto value) {
    curl_easy_setopt(handle.get(), option, value);
  };
  constexpr long connect_s = 10, slow_bytes = 1000, slow_s = 60;
  {
    const std::unique_ptr<std::FILE, CloseFile> out(std::fopen(to.c_str(), "wb"));
    if (!out) return fail({.code = Errc::io, .where = to.string(), .what = "file not created"});
    char reason[CURL_ERROR_SIZE] = "";
    set(CURLOPT_URL, url.c_str());
    set(CURLOPT_PROTOCOLS_STR, "http,https");
    set(CURLOPT_HTTPHEADER, headers.get());
    set(CURLOPT_USERAGENT, "weft");
    set(CURLOPT_CONNECTTIMEOUT, connect_s);
    set(CURLOPT_LOW_SPEED_LIMIT, slow_bytes);
    set(CURLOPT_LOW_SPEED_TIME, slow_s);
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_FAILONERROR, 1L);
    set(CURLOPT_WRITEDATA, out.get());
    set(CURLOPT_ERRORBUFFER, &reason[0]);
    if (!tls_ca.empty()) set(CURLOPT_CAINFO, tls_ca.c_str());
    const CURLcode code = curl_easy_perform(handle.get());
    if (code != CURLE_OK)
      return fail({.code = Errc::io,
                   .where = url,
                   .what = "file not fetched",
                   .got = reason[0] != '\0' ? reason : curl_easy_strerror(code),
                   .hint = "Check the token, and that the rig's weftd runs with --http"});
  }
  return {};
}

Result<std::vector<Wanted>> wanted_of_campaign(LabStore& store, std::int64_t id) {
  const auto campaign = store.campaign(id);
  if (!campaign) return pass(campaign.error());
  std::vector<Wanted> out;
  for (const lab::PartEntry& part : campaign->parts) {
    if (part.state != lab::PartState::done)
      return fail({.code = Errc::wrong_state,
                   .where = lab::campaign_text(id) + ", part " + std::to_string(part.number) +
                            " (" + part.fabric + ")",
                   .what = "part not done",
                   .got = std::string(lab::to_string(part.state)),
                   .hint = "Wait until all parts are done (weft lab campaign)"});
    out.push_back({part.fabric, part.holder, part.run, part.dataset_sha256});
  }
  return out;
}

/// One data set of each digest that begins so.
Result<std::vector<Wanted>> wanted_of_digest(LabStore& store, const std::string& digest) {
  const auto datasets = store.datasets(digest);
  if (!datasets) return pass(datasets.error());
  std::vector<Wanted> out;
  for (const lab::DatasetEntry& one : *datasets)
    if (std::ranges::none_of(out, [&](const Wanted& w) { return w.sha256 == one.dataset_sha256; }))
      out.push_back({one.dataset_sha256.substr(0, 12), one.rig, one.run, one.dataset_sha256, true});
  if (out.empty())
    return fail({.code = Errc::not_found,
                 .where = digest,
                 .what = "no data set with this digest in the store",
                 .hint = "Search with `weft lab search --digest`"});
  return out;
}

/// The store states where a rig is; anyone who can publish a rig could ask for tokens there.
bool is_safe_for_tokens(std::string_view url) {
  if (url.find('@') != std::string_view::npos) return false;  // the host is what follows
  if (url.starts_with("https://")) return true;
  return std::ranges::any_of(
      std::array<std::string_view, 2>{"127.0.0.1", "localhost"}, [&](std::string_view host) {
        const std::string start = "http://" + std::string(host);
        return url.starts_with(start) &&
               (url.size() == start.size() || url[start.size()] == ':' || url[start.size()] == '/');
      });
}

Status fetch_one(LabStore& store, const std::vector<lab::RigEntry>& rigs, const Wanted& one,
                 const FetchArgs& args, const Tokens& tokens, const fs::path& to) {
  const auto datasets = store.datasets(one.sha256);
  if (!datasets) return pass(datasets.error());
  std::error_code unseen;
  for (const lab::DatasetEntry& place : *datasets)  // on this machine, or in a shared folder
    if ((one.from_any_rig || (place.rig == one.rig && place.run == one.run)) &&
        fs::exists(place.place, unseen) && copy_file(place.place, to, one.sha256))
      return {};
  const auto rig = std::ranges::find(rigs, one.rig, &lab::RigEntry::name);
  const json status =
      rig == rigs.end() ? json::object() : json::parse(rig->status_json, nullptr, false);
  const bool has_http = status.is_object() && status.contains("http") && status["http"].is_string();
  const std::string http = has_http ? status["http"].get<std::string>() : "";
  if (!http.empty() && !is_safe_for_tokens(http))
    return fail({.code = Errc::invalid_argument,
                 .where = one.rig,
                 .what = "rig's address is not encrypted, so no token is sent to it",
                 .expected = "https://...",
                 .got = http,
                 .hint = "Start its weftd with --tls-cert and --tls-key"});
  if (http.empty())
    return fail({.code = Errc::not_found,
                 .where = one.rig + " " + one.run,
                 .what = "file cannot be reached from this machine",
                 .expected = "a shared folder, or a rig with --http",
                 .hint = "Run this command on the machine of the rig"});
  AtomicFile atomic(to);
  const auto token = tokens.find(one.rig);
  if (token == tokens.end())
    return fail(
        {.code = Errc::not_found,
         .where = one.rig,
         .what = "no token for this rig",
         .hint = "Add a line RIG TOKEN to the file of --token-file; an observer's is enough"});
  if (Status got = download(http + "/data/" + one.run + "/" + dataset_file_name, token->second,
                            args.tls_ca, atomic.temporary());
      !got)
    return got;
  if (Status same = require_digest(atomic.temporary(), one.sha256); !same)
    return pass(same.error(), one.rig);
  return atomic.publish();
}

Result<int> run_fetch(const FetchArgs& args, Console& console) {
  auto address = lab::LabAddress::parse(args.uri.empty() ? from_environment("WEFT_LAB") : args.uri);
  if (!address) return pass(address.error(), "--lab");
  const auto tokens = read_tokens(args);
  if (!tokens) return pass(tokens.error());
  auto store = LabStore::open(std::move(*address), "lab fetch");
  if (!store) return pass(store.error());
  const auto id = lab::campaign_number(args.what);
  const auto wanted = id ? wanted_of_campaign(*store, *id) : wanted_of_digest(*store, args.what);
  if (!wanted) return pass(wanted.error());
  const auto rigs = store->rigs();
  if (!rigs) return pass(rigs.error());
  std::error_code error;
  fs::create_directories(args.out, error);
  json files = json::array();
  std::string text;
  for (const Wanted& one : *wanted) {
    if (one.name != fs::path(one.name).filename() || one.name.starts_with('.'))
      return fail({.code = Errc::invalid_argument,
                   .where = args.what,
                   .what = "fabric's name is no file name",
                   .got = shortened(one.name)});
    const fs::path to = args.out / (one.name + ".h5");
    if (Status done = fetch_one(*store, *rigs, one, args, *tokens, to); !done)
      return pass(done.error(), one.name);
    files.push_back({{"file", to.string()},
                     {"rig", one.rig},
                     {"run", one.run},
                     {"dataset_sha256", one.sha256}});
    text += to.string() + "  " + one.rig + "  " + one.sha256 + "\n";
  }
  if (id)
    text +=
        "To merge them: weft dataset merge --by-rig " + args.out.string() + "/*.h5 -o merged.h5\n";
  print(console, text, {{"command", "lab fetch"}, {"files", std::move(files)}});
  return exit_ok;
}

}  // namespace

void add_lab_rig_commands(const CommandGroup& lab) {
  add_daemon_command<AcceptArgs>(lab, "accept", run_accept);
  lab.add<FetchArgs>("fetch", run_fetch);
}

}  // namespace weft::daemon::cli
