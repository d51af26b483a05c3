-- The laboratory's store: tables, and the functions by which logins change them. Runs as weft_owner.
-- Only weft_owner writes a table. A function checks that the login owns the rig that it names.

-- New functions are for no one until they are granted.
ALTER DEFAULT PRIVILEGES REVOKE ALL ON FUNCTIONS FROM PUBLIC;
GRANT USAGE ON SCHEMA weft TO weft_reader;

CREATE DOMAIN weft.digest AS text COLLATE "C" CHECK (VALUE ~ '^[0-9a-f]{64}$');
COMMENT ON DOMAIN weft.digest IS 'SHA-256, hexadecimal';
CREATE DOMAIN weft.bench_kind AS text CHECK (VALUE IN ('unknown', 'simulated', 'real'));

CREATE TABLE weft.migration (
  version integer PRIMARY KEY,
  name text NOT NULL,
  applied_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  applied_by text NOT NULL DEFAULT session_user
);
COMMENT ON TABLE weft.migration IS 'Versions of this schema, see daemon/service/lab/schema';

-- One row. A rig that finds another id publishes all its runs again.
CREATE TABLE weft.store (
  id uuid PRIMARY KEY DEFAULT gen_random_uuid()
);
COMMENT ON TABLE weft.store IS 'Identity of this store, made at its installation';
INSERT INTO weft.store DEFAULT VALUES;

CREATE TABLE weft.rig (
  name text PRIMARY KEY CHECK (length(name) BETWEEN 1 AND 64 AND name !~ '[[:cntrl:],]'),
  login text NOT NULL UNIQUE,
  address text NOT NULL,
  bench weft.bench_kind NOT NULL,
  state text NOT NULL,
  seen_at timestamptz NOT NULL,
  instance text,
  rig_sha256 weft.digest,
  -- Of the text: a stored 1e130000 has a few bytes, but its text has 130 001.
  status jsonb NOT NULL CHECK (jsonb_typeof(status) = 'object' AND octet_length(status::text) < 65536)
);
COMMENT ON TABLE weft.rig IS 'One row for each rig that has published itself';
COMMENT ON COLUMN weft.rig.login IS 'login that owns the name: session_user of its first publication';
COMMENT ON COLUMN weft.rig.address IS 'of its API, such as tls://bench17:8443';
COMMENT ON COLUMN weft.rig.bench IS 'simulated and emulated benches are "simulated"';
COMMENT ON COLUMN weft.rig.state IS 'as rig.state of the API';
COMMENT ON COLUMN weft.rig.seen_at IS 'last publication, on the clock of this server';
COMMENT ON COLUMN weft.rig.instance IS 'memory (weftd.sqlite) of the daemon that published last';
COMMENT ON COLUMN weft.rig.rig_sha256 IS 'digest of the rig file';
COMMENT ON COLUMN weft.rig.status IS 'run, trial, trials, eta_s, next_action, alarms';

CREATE TABLE weft.run (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  rig text NOT NULL REFERENCES weft.rig,
  run text NOT NULL CHECK (length(run) BETWEEN 1 AND 64),
  recipe text NOT NULL,
  recipe_sha256 weft.digest,
  seed bigint,
  fabrics text[] NOT NULL,
  bench weft.bench_kind NOT NULL,
  state text NOT NULL,
  trials_planned bigint NOT NULL CHECK (trials_planned >= 0),
  trials_complete bigint NOT NULL CHECK (trials_complete >= 0),
  started_at timestamptz NOT NULL,
  ended_at timestamptz,
  place text NOT NULL,
  revision bigint NOT NULL,
  search_text text NOT NULL,
  UNIQUE (rig, run)
);
COMMENT ON TABLE weft.run IS 'Runs of all rigs';
COMMENT ON COLUMN weft.run.run IS 'id on its rig, such as R-000318';
COMMENT ON COLUMN weft.run.recipe IS 'name of the recipe';
COMMENT ON COLUMN weft.run.state IS 'state of the run; outcome of an ended one';
COMMENT ON COLUMN weft.run.place IS 'folder on the rig or in a shared folder';
COMMENT ON COLUMN weft.run.revision IS 'UTC of this state [us since 1970]; an older one changes nothing';
COMMENT ON COLUMN weft.run.search_text IS 'rig, run, recipe, fabrics and place in lower case';
CREATE INDEX run_by_start ON weft.run (started_at DESC, id DESC);
CREATE INDEX run_by_rig ON weft.run (rig, started_at DESC, id DESC);
CREATE INDEX run_by_recipe ON weft.run (recipe, started_at DESC, id DESC);
CREATE INDEX run_by_recipe_digest ON weft.run (recipe_sha256);
CREATE INDEX run_by_fabric ON weft.run USING gin (fabrics);
DO $body$
DECLARE
  place text := (SELECT n.nspname FROM pg_extension e JOIN pg_namespace n ON n.oid = e.extnamespace
                 WHERE e.extname = 'pg_trgm');
BEGIN
  IF place IS NOT NULL THEN
    EXECUTE format('CREATE INDEX run_by_text ON weft.run USING gin (search_text %I.gin_trgm_ops)', place);
  END IF;
END
$body$;

CREATE TABLE weft.dataset (
  run_id bigint NOT NULL REFERENCES weft.run,
  dataset_sha256 weft.digest NOT NULL,
  trials bigint NOT NULL CHECK (trials >= 0),
  bytes bigint NOT NULL CHECK (bytes >= 0),
  place text NOT NULL,
  PRIMARY KEY (run_id, dataset_sha256)
);
COMMENT ON TABLE weft.dataset IS 'Data sets by digest; the files stay on the rigs';
COMMENT ON COLUMN weft.dataset.place IS 'path or address of the file';
CREATE INDEX dataset_by_digest ON weft.dataset (dataset_sha256);

CREATE TABLE weft.certificate (
  run_id bigint NOT NULL REFERENCES weft.run,
  certificate_sha256 weft.digest NOT NULL,
  document json NOT NULL,
  PRIMARY KEY (run_id, certificate_sha256)
);
COMMENT ON TABLE weft.certificate IS 'Certificates of runs';
COMMENT ON COLUMN weft.certificate.document IS 'text of the file, byte by byte';
CREATE INDEX certificate_by_digest ON weft.certificate (certificate_sha256);

CREATE TABLE weft.trial (
  run_id bigint NOT NULL REFERENCES weft.run,
  index bigint NOT NULL CHECK (index >= 0),
  label text NOT NULL,
  exploration text NOT NULL,
  repetition bigint NOT NULL,
  outcome text NOT NULL,
  sha256 weft.digest,
  PRIMARY KEY (run_id, index)
);
COMMENT ON TABLE weft.trial IS 'Trials of runs';
COMMENT ON COLUMN weft.trial.index IS 'place in the order of the campaign, from 0';
COMMENT ON COLUMN weft.trial.sha256 IS 'digest of its samples';
CREATE INDEX trial_by_digest ON weft.trial (sha256);

CREATE TABLE weft.campaign (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  name text NOT NULL,
  recipe_text text NOT NULL CHECK (octet_length(recipe_text) <= 1048576),
  recipe_sha256 weft.digest NOT NULL,
  seed bigint,
  parameters json NOT NULL CHECK (octet_length(parameters::text) < 65536),
  submitted_by text NOT NULL,
  submitted_at timestamptz NOT NULL,
  submission text,
  state text NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
  UNIQUE (submitted_by, submission)
);
COMMENT ON TABLE weft.campaign IS 'Campaigns that are split into parts for several rigs';
COMMENT ON COLUMN weft.campaign.recipe_text IS 'the recipe with its parameters unbound';
COMMENT ON COLUMN weft.campaign.parameters IS '{NAME: value}';
COMMENT ON COLUMN weft.campaign.submission IS 'key of the submission; a repeated one returns the same campaign';

CREATE TABLE weft.part (
  campaign bigint NOT NULL REFERENCES weft.campaign,
  number bigint NOT NULL CHECK (number >= 1),
  fabric text NOT NULL,
  rigs text[] NOT NULL CHECK (cardinality(rigs) >= 1),
  state text NOT NULL CHECK (state IN ('queued', 'held', 'done', 'failed', 'cancelled')),
  holder text REFERENCES weft.rig,
  attempt bigint NOT NULL DEFAULT 0,
  lease_until timestamptz,
  run text,
  dataset_sha256 weft.digest,
  error text,
  PRIMARY KEY (campaign, number),
  UNIQUE (campaign, fabric),
  CHECK ((state = 'held') = (lease_until IS NOT NULL))
);
COMMENT ON TABLE weft.part IS 'One fabric of a campaign, mounted once, on one rig';
COMMENT ON COLUMN weft.part.rigs IS 'rigs that may take it';
COMMENT ON COLUMN weft.part.holder IS 'rig of the newest attempt';
COMMENT ON COLUMN weft.part.attempt IS 'claims so far';
COMMENT ON COLUMN weft.part.lease_until IS 'of a held part; after it the next claim may take it';
COMMENT ON COLUMN weft.part.run IS 'run of the holder that recorded it';
CREATE INDEX part_open ON weft.part (campaign, number) WHERE state IN ('queued', 'held');

-- No role but weft_owner may read this table.
CREATE TABLE weft.part_lease (
  campaign bigint NOT NULL,
  number bigint NOT NULL,
  rig text NOT NULL REFERENCES weft.rig,
  token_sha256 bytea NOT NULL,
  PRIMARY KEY (campaign, number),
  FOREIGN KEY (campaign, number) REFERENCES weft.part
);
COMMENT ON TABLE weft.part_lease IS 'Newest lease of each part; the token itself is with the rig only';

GRANT SELECT ON weft.migration, weft.store, weft.rig, weft.run, weft.dataset, weft.certificate, weft.trial, weft.campaign, weft.part
  TO weft_reader;

-- Functions. Each has a fixed search path, because it runs with the owner's rights.

CREATE FUNCTION weft.require_rig(wanted text) RETURNS void
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
BEGIN
  IF EXISTS (SELECT FROM weft.rig r WHERE r.name = wanted AND r.login = session_user) THEN
    RETURN;
  ELSIF EXISTS (SELECT FROM weft.rig r WHERE r.name = wanted) THEN
    RAISE EXCEPTION 'rig % belongs to another login', wanted USING ERRCODE = '42501',
      HINT = 'Each rig has a login of its own';
  END IF;
  RAISE EXCEPTION 'rig % unknown in the store', wanted USING ERRCODE = 'P0002', HINT = 'Publish the rig first';
END
$body$;

CREATE FUNCTION weft.require_run(wanted_rig text, wanted_run text) RETURNS bigint
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  found_id bigint;
BEGIN
  PERFORM weft.require_rig(wanted_rig);
  SELECT r.id INTO found_id FROM weft.run r WHERE r.rig = wanted_rig AND r.run = wanted_run;
  IF found_id IS NULL THEN
    RAISE EXCEPTION 'run % of rig % unknown in the store', wanted_run, wanted_rig USING ERRCODE = 'P0002',
      HINT = 'Publish the run first';
  END IF;
  RETURN found_id;
END
$body$;

CREATE FUNCTION weft.publish_rig(new_name text, new_address text, new_bench text, new_state text,
                                 new_sha256 text, new_status jsonb, new_instance text DEFAULT NULL) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  before weft.rig;
  owned text;
BEGIN
  SELECT r.name INTO owned FROM weft.rig r WHERE r.login = session_user AND r.name <> new_name;
  IF owned IS NOT NULL THEN
    RAISE EXCEPTION 'login % owns rig % already', session_user, owned USING ERRCODE = '42501',
      HINT = 'Each rig has a login of its own';
  END IF;
  SELECT * INTO before FROM weft.rig r WHERE r.name = new_name FOR UPDATE;
  IF before.login = session_user AND before.instance <> new_instance
     AND before.seen_at > clock_timestamp() - interval '30 seconds' THEN
    RAISE EXCEPTION 'another weftd publishes rig %', new_name USING ERRCODE = 'WL003',
      HINT = 'End one of them, or wait 30 s after a new data folder';
  END IF;
  INSERT INTO weft.rig AS r (name, login, address, bench, state, seen_at, instance, rig_sha256, status)
  VALUES (new_name, session_user, new_address, new_bench, new_state, clock_timestamp(), new_instance, NULLIF(new_sha256, ''),
          new_status)
  ON CONFLICT (name) DO UPDATE
    SET address = EXCLUDED.address, bench = EXCLUDED.bench, state = EXCLUDED.state, seen_at = EXCLUDED.seen_at,
        instance = EXCLUDED.instance, rig_sha256 = EXCLUDED.rig_sha256, status = EXCLUDED.status
    WHERE r.login = session_user;
  IF NOT FOUND THEN
    PERFORM weft.require_rig(new_name);
  END IF;
  IF (before.address, before.bench, before.state, before.rig_sha256, before.status)
     IS DISTINCT FROM (new_address, new_bench, new_state, NULLIF(new_sha256, ''), new_status) THEN
    PERFORM pg_notify('weft_rigs', new_name);
  END IF;
END
$body$;

CREATE FUNCTION weft.publish_run(new_rig text, new_run text, new_recipe text, new_recipe_sha256 text, new_seed bigint,
                                 new_fabrics text[], new_bench text, new_state text, new_planned bigint, new_complete bigint,
                                 started_us bigint, ended_us bigint, new_place text, new_revision bigint) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  epoch CONSTANT timestamptz := '1970-01-01 00:00:00+00';
  unit CONSTANT interval := '1 microsecond';
BEGIN
  PERFORM weft.require_rig(new_rig);
  -- A rig whose memory was lost, or a second daemon with its name, begins again with R-000001.
  IF EXISTS (SELECT FROM weft.run r WHERE r.rig = new_rig AND r.run = new_run AND r.started_at <> epoch + started_us * unit) THEN
    RAISE EXCEPTION 'run % of rig % is another one in the store', new_run, new_rig USING ERRCODE = 'WL002',
      HINT = 'Give a rig with a new weftd.sqlite a new name and login';
  END IF;
  INSERT INTO weft.run AS r (rig, run, recipe, recipe_sha256, seed, fabrics, bench, state, trials_planned,
                             trials_complete, started_at, ended_at, place, revision, search_text)
  VALUES (new_rig, new_run, new_recipe, NULLIF(new_recipe_sha256, ''), new_seed, new_fabrics, new_bench, new_state,
          new_planned, new_complete, epoch + started_us * unit, epoch + ended_us * unit, new_place, new_revision,
          lower(concat_ws(' ', new_rig, new_run, new_recipe, array_to_string(new_fabrics, ' '), new_place)))
  ON CONFLICT (rig, run) DO UPDATE
    SET recipe = EXCLUDED.recipe, recipe_sha256 = EXCLUDED.recipe_sha256, seed = EXCLUDED.seed,
        fabrics = EXCLUDED.fabrics, bench = EXCLUDED.bench, state = EXCLUDED.state,
        trials_planned = EXCLUDED.trials_planned, trials_complete = EXCLUDED.trials_complete,
        ended_at = EXCLUDED.ended_at, place = EXCLUDED.place,
        revision = EXCLUDED.revision, search_text = EXCLUDED.search_text
    WHERE r.revision < EXCLUDED.revision AND r.started_at = EXCLUDED.started_at;
END
$body$;

CREATE FUNCTION weft.publish_dataset(of_rig text, of_run text, new_sha256 text, new_trials bigint, new_bytes bigint,
                                     new_place text) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
BEGIN
  INSERT INTO weft.dataset AS d (run_id, dataset_sha256, trials, bytes, place)
  VALUES (weft.require_run(of_rig, of_run), new_sha256, new_trials, new_bytes, new_place)
  ON CONFLICT (run_id, dataset_sha256) DO UPDATE
    SET trials = EXCLUDED.trials, bytes = EXCLUDED.bytes, place = EXCLUDED.place
    WHERE (d.trials, d.bytes, d.place) IS DISTINCT FROM (EXCLUDED.trials, EXCLUDED.bytes, EXCLUDED.place);
END
$body$;

CREATE FUNCTION weft.publish_certificate(of_rig text, of_run text, new_sha256 text, new_document json) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
BEGIN
  INSERT INTO weft.certificate (run_id, certificate_sha256, document)
  VALUES (weft.require_run(of_rig, of_run), new_sha256, new_document)
  ON CONFLICT (run_id, certificate_sha256) DO NOTHING;
END
$body$;

-- `trials`: [{index, label, exploration, repetition, outcome, sha256}].
CREATE FUNCTION weft.publish_trials(of_rig text, of_run text, trials json) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  key CONSTANT bigint := weft.require_run(of_rig, of_run);
BEGIN
  INSERT INTO weft.trial AS t (run_id, index, label, exploration, repetition, outcome, sha256)
  SELECT key, n.index, n.label, n.exploration, n.repetition, n.outcome, NULLIF(n.sha256, '')
  FROM json_to_recordset(trials) AS n(index bigint, label text, exploration text, repetition bigint, outcome text, sha256 text)
  ON CONFLICT (run_id, index) DO UPDATE
    SET label = EXCLUDED.label, exploration = EXCLUDED.exploration, repetition = EXCLUDED.repetition,
        outcome = EXCLUDED.outcome, sha256 = EXCLUDED.sha256
    WHERE (t.label, t.exploration, t.repetition, t.outcome, t.sha256)
          IS DISTINCT FROM (EXCLUDED.label, EXCLUDED.exploration, EXCLUDED.repetition, EXCLUDED.outcome, EXCLUDED.sha256);
END
$body$;

CREATE FUNCTION weft.submit_campaign(new_name text, new_recipe text, new_recipe_sha256 text, new_seed bigint, new_parameters json,
                                     fabrics text[], allowed text[], new_submission text) RETURNS bigint
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  new_id bigint;
  missing text;
BEGIN
  IF coalesce(cardinality(fabrics), 0) = 0 OR coalesce(cardinality(allowed), 0) = 0 THEN
    RAISE EXCEPTION 'campaign without fabric or rig' USING ERRCODE = '22023';
  END IF;
  SELECT string_agg(a, ', ') INTO missing FROM unnest(allowed) a WHERE NOT EXISTS (SELECT FROM weft.rig r WHERE r.name = a);
  IF missing IS NOT NULL THEN
    RAISE EXCEPTION 'rigs unknown in the store: %', missing USING ERRCODE = 'P0002', HINT = 'List them: weft lab rigs';
  END IF;
  INSERT INTO weft.campaign (name, recipe_text, recipe_sha256, seed, parameters, submitted_by, submitted_at, submission, state)
  VALUES (new_name, new_recipe, new_recipe_sha256, new_seed, new_parameters, session_user, clock_timestamp(),
          NULLIF(new_submission, ''), 'queued')
  ON CONFLICT (submitted_by, submission) DO NOTHING RETURNING id INTO new_id;
  IF new_id IS NULL THEN
    RETURN (SELECT c.id FROM weft.campaign c WHERE c.submitted_by = session_user AND c.submission = new_submission);
  END IF;
  INSERT INTO weft.part (campaign, number, fabric, rigs, state)
  SELECT new_id, f.number, f.fabric, allowed, 'queued' FROM unnest(fabrics) WITH ORDINALITY AS f(fabric, number);
  PERFORM pg_notify('weft_parts', new_id::text);
  RETURN new_id;
END
$body$;

-- Rows are always locked in this order: parts by number, then their campaign.
CREATE FUNCTION weft.settle_campaign(of_campaign bigint) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  before text;
BEGIN
  SELECT c.state INTO before FROM weft.campaign c WHERE c.id = of_campaign FOR UPDATE;
  IF before = 'cancelled' OR EXISTS (SELECT FROM weft.part p WHERE p.campaign = of_campaign AND p.state IN ('queued', 'held')) THEN
    RETURN;
  END IF;
  UPDATE weft.campaign SET state =
    CASE WHEN EXISTS (SELECT FROM weft.part p WHERE p.campaign = of_campaign AND p.state <> 'done') THEN 'failed' ELSE 'done' END
  WHERE id = of_campaign;
END
$body$;

CREATE FUNCTION weft.cancel_campaign(wanted bigint) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  found_campaign weft.campaign;
BEGIN
  PERFORM FROM weft.part p WHERE p.campaign = wanted ORDER BY p.number FOR UPDATE;
  SELECT * INTO found_campaign FROM weft.campaign c WHERE c.id = wanted FOR UPDATE;
  IF found_campaign.id IS NULL THEN
    RAISE EXCEPTION 'campaign % unknown in the store', wanted USING ERRCODE = 'P0002';
  ELSIF found_campaign.submitted_by <> session_user AND NOT pg_has_role(session_user, 'weft_owner', 'MEMBER') THEN
    RAISE EXCEPTION 'campaign % was submitted by %', wanted, found_campaign.submitted_by USING ERRCODE = '42501',
      HINT = 'Only this login or an administrator can cancel it';
  ELSIF found_campaign.state IN ('done', 'failed') THEN
    RAISE EXCEPTION 'campaign % has ended already', wanted USING ERRCODE = '55000';
  END IF;
  UPDATE weft.campaign SET state = 'cancelled' WHERE id = wanted;
  UPDATE weft.part SET state = 'cancelled', lease_until = NULL
  WHERE campaign = wanted AND (state = 'queued' OR state = 'held' AND lease_until <= clock_timestamp());
END
$body$;

-- One part at most. A token is 244 random bits.
CREATE FUNCTION weft.claim_part(for_rig text, can_mount text[], refused bigint[], duration interval)
RETURNS TABLE (campaign bigint, number bigint, token text, until_us bigint, attempt bigint, fabric text,
               name text, recipe_text text, recipe_sha256 text, parameters text, seed bigint)
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
#variable_conflict use_column
DECLARE
  at CONSTANT timestamptz := clock_timestamp();
  new_token CONSTANT text := replace(gen_random_uuid()::text || gen_random_uuid()::text, '-', '');
  taken weft.part;
BEGIN
  PERFORM weft.require_rig(for_rig);
  PERFORM weft.require_duration(duration);
  SELECT p.* INTO taken FROM weft.part p JOIN weft.campaign c ON c.id = p.campaign
  WHERE p.state IN ('queued', 'held') AND (p.state = 'queued' OR p.lease_until <= at)
    AND c.state <> 'cancelled' AND for_rig = ANY (p.rigs)
    AND (cardinality(can_mount) = 0 OR p.fabric = ANY (can_mount)) AND NOT p.campaign = ANY (refused)
  ORDER BY p.campaign, p.number LIMIT 1 FOR UPDATE OF p SKIP LOCKED;
  IF taken.campaign IS NULL THEN
    RETURN;
  END IF;
  UPDATE weft.part p SET state = 'held', holder = for_rig, attempt = p.attempt + 1, lease_until = at + duration,
                         run = NULL, error = NULL
  WHERE p.campaign = taken.campaign AND p.number = taken.number;
  INSERT INTO weft.part_lease AS l (campaign, number, rig, token_sha256)
  VALUES (taken.campaign, taken.number, for_rig, sha256(convert_to(new_token, 'UTF8')))
  ON CONFLICT (campaign, number) DO UPDATE SET rig = EXCLUDED.rig, token_sha256 = EXCLUDED.token_sha256;
  UPDATE weft.campaign c SET state = 'running' WHERE c.id = taken.campaign AND c.state = 'queued';
  RETURN QUERY SELECT taken.campaign, taken.number, new_token, (extract(epoch FROM at + duration) * 1000000)::bigint,
                      taken.attempt + 1, taken.fabric, c.name, c.recipe_text, c.recipe_sha256::text, c.parameters::text, c.seed
               FROM weft.campaign c WHERE c.id = taken.campaign;
END
$body$;

-- Locks the part for the holder of this token. Errors: WL001, another rig or no one holds it.
CREATE FUNCTION weft.require_lease(of_campaign bigint, of_number bigint, shown text) RETURNS weft.part
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  locked weft.part;
BEGIN
  SELECT * INTO locked FROM weft.part p WHERE p.campaign = of_campaign AND p.number = of_number FOR UPDATE;
  PERFORM FROM weft.part_lease l JOIN weft.rig r ON r.name = l.rig
  WHERE l.campaign = of_campaign AND l.number = of_number AND r.login = session_user
    AND l.token_sha256 = sha256(convert_to(shown, 'UTF8'));
  IF NOT FOUND THEN
    RAISE EXCEPTION 'lease of part % of campaign % lost', of_number, of_campaign USING ERRCODE = 'WL001',
      HINT = 'Another rig may record this fabric; keep this run as one of its own';
  END IF;
  RETURN locked;
END
$body$;

CREATE FUNCTION weft.require_duration(duration interval) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
BEGIN
  IF duration IS NULL OR duration NOT BETWEEN interval '1 second' AND interval '1 day' THEN
    RAISE EXCEPTION 'duration of a lease out of range: % (expected 1 s to 1 day)', duration USING ERRCODE = '22023';
  END IF;
END
$body$;

CREATE FUNCTION weft.renew_part(of_campaign bigint, of_number bigint, shown text, duration interval)
RETURNS TABLE (until_us bigint, is_cancelled boolean)
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  at CONSTANT timestamptz := clock_timestamp();
  locked CONSTANT weft.part := weft.require_lease(of_campaign, of_number, shown);
BEGIN
  PERFORM weft.require_duration(duration);
  IF locked.state <> 'held' THEN
    RAISE EXCEPTION 'part % of campaign % is not held', of_number, of_campaign USING ERRCODE = 'WL001';
  END IF;
  UPDATE weft.part SET lease_until = at + duration WHERE campaign = of_campaign AND number = of_number;
  RETURN QUERY SELECT (extract(epoch FROM at + duration) * 1000000)::bigint, c.state = 'cancelled'
               FROM weft.campaign c WHERE c.id = of_campaign;
END
$body$;

CREATE FUNCTION weft.finish_part(of_campaign bigint, of_number bigint, shown text, is_done boolean, by_run text,
                                 new_sha256 text, new_error text) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  locked CONSTANT weft.part := weft.require_lease(of_campaign, of_number, shown);
  new_state CONSTANT text := CASE WHEN is_done THEN 'done' ELSE 'failed' END;
BEGIN
  IF (locked.state, locked.run, locked.dataset_sha256, locked.error)
     IS NOT DISTINCT FROM (new_state, NULLIF(by_run, ''), NULLIF(new_sha256, ''), NULLIF(new_error, '')) THEN
    RETURN;  -- the same result again
  ELSIF locked.state <> 'held' THEN
    RAISE EXCEPTION 'part % of campaign % is finished already', of_number, of_campaign USING ERRCODE = 'WL001';
  END IF;
  UPDATE weft.part SET state = new_state, lease_until = NULL, run = NULLIF(by_run, ''),
                       dataset_sha256 = NULLIF(new_sha256, ''), error = NULLIF(new_error, '')
  WHERE campaign = of_campaign AND number = of_number;
  PERFORM weft.settle_campaign(of_campaign);
END
$body$;

CREATE FUNCTION weft.give_back_part(of_campaign bigint, of_number bigint, shown text) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $body$
DECLARE
  locked CONSTANT weft.part := weft.require_lease(of_campaign, of_number, shown);
BEGIN
  IF locked.state <> 'held' THEN
    RAISE EXCEPTION 'part % of campaign % is not held', of_number, of_campaign USING ERRCODE = 'WL001';
  END IF;
  UPDATE weft.part p
  SET state = CASE WHEN c.state = 'cancelled' THEN 'cancelled' ELSE 'queued' END, lease_until = NULL
  FROM weft.campaign c WHERE c.id = p.campaign AND p.campaign = of_campaign AND p.number = of_number;
  DELETE FROM weft.part_lease WHERE campaign = of_campaign AND number = of_number;
  PERFORM pg_notify('weft_parts', of_campaign::text);
END
$body$;

GRANT EXECUTE ON FUNCTION weft.publish_rig, weft.publish_run, weft.publish_dataset, weft.publish_certificate, weft.publish_trials,
  weft.claim_part, weft.renew_part, weft.finish_part, weft.give_back_part TO weft_rig;
GRANT EXECUTE ON FUNCTION weft.submit_campaign, weft.cancel_campaign TO weft_submitter;

INSERT INTO weft.migration (version, name) VALUES (1, '0001_store');
