#pragma once
// Settings of notifications: the file of `weftd --notify`, read once, and message templates.
// Secrets are in separate files that other users may not read. Source: docs/howto/notify.md.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/service/notify/notify_event.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::notify {

enum class TlsUse : std::uint8_t {
  verified,    ///< the default
  unverified,  ///< encrypted, for any server
  off
};

struct WebhookSettings {
  std::string url;    ///< http or https; may be a secret (url_file)
  std::string token;  ///< sent as a bearer token; empty: none
  std::vector<std::pair<std::string, std::string>> headers;  ///< name, template
  std::string body_json;  ///< template, see expand_body(); empty: the event's own object
  std::string ca_file;    ///< the only trusted CAs; empty: the system's
  TlsUse tls = TlsUse::verified;
};

struct MqttSettings {
  std::string host;
  int port = 8883;
  std::string topic;  ///< prefix of /availability, /state and /event
  std::string user, password;
  std::string ca_file;  ///< as in WebhookSettings
  TlsUse tls = TlsUse::verified;
};

struct NotifySettings {
  std::vector<EventKind> events;  ///< to send; others are only counted
  std::uint64_t disk_low_bytes = 5'000'000'000;
  std::optional<WebhookSettings> webhook;
  std::optional<MqttSettings> mqtt;
};

/// `bench`: name of the rig, part of the default topic. Paths in the file are relative to its
/// folder. Errors: not_found, io; parse, with the first of all problems; wrong_state, a secret that
/// others may read.
Result<NotifySettings> load_notify_settings(const std::filesystem::path& file,
                                            const std::string& bench);

/// Replaces {run}, {title} and other keys of to_json(Event) by their values.
std::string expand(const std::string& text, const nlohmann::json& event);
/// If the template is a string, returns that string, expanded. If it is an object or list, returns
/// JSON with each string in it expanded. A string of one placeholder becomes its value, so that
/// numbers stay numbers.
std::string expand_body(const std::string& body_json, const nlohmann::json& event);

}  // namespace weft::daemon::notify
