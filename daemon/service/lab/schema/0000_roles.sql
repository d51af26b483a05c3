-- Roles and the schema itself. Runs at each installation, as the administrator, and changes nothing the
-- second time. weft_owner owns everything and logs in nowhere; an administrator grants the other roles
-- to logins.
DO $body$
DECLARE
  wanted text;
BEGIN
  IF current_setting('server_encoding') <> 'UTF8' THEN
    RAISE EXCEPTION 'encoding of the database is not UTF8' USING ERRCODE = '0A000',
      HINT = 'CREATE DATABASE lab ENCODING ''UTF8'' TEMPLATE template0';
  END IF;
  FOREACH wanted IN ARRAY ARRAY['weft_owner', 'weft_reader', 'weft_submitter', 'weft_rig'] LOOP
    CONTINUE WHEN EXISTS (SELECT FROM pg_roles WHERE rolname = wanted);
    BEGIN
      EXECUTE format('CREATE ROLE %I NOLOGIN', wanted);
    EXCEPTION WHEN duplicate_object OR unique_violation THEN
      NULL;  -- an installation in another database of this server was faster
    END;
  END LOOP;
  -- An administrator who is no superuser must be a member to act as the owner.
  IF NOT (SELECT rolsuper FROM pg_roles WHERE rolname = current_user)
     AND NOT EXISTS (SELECT FROM pg_auth_members m JOIN pg_roles g ON g.oid = m.roleid JOIN pg_roles u ON u.oid = m.member
                     WHERE g.rolname = 'weft_owner' AND u.rolname = current_user) THEN
    EXECUTE format('GRANT weft_owner TO %I', current_user);
  END IF;
  -- Rigs and submitters read too.
  FOREACH wanted IN ARRAY ARRAY['weft_submitter', 'weft_rig'] LOOP
    IF NOT pg_has_role(wanted, 'weft_reader', 'USAGE') THEN
      EXECUTE format('GRANT weft_reader TO %I', wanted);
    END IF;
  END LOOP;
  IF NOT EXISTS (SELECT FROM pg_namespace WHERE nspname = 'weft') THEN
    CREATE SCHEMA weft AUTHORIZATION weft_owner;
  END IF;
  IF (SELECT nspowner::regrole::text FROM pg_namespace WHERE nspname = 'weft') <> 'weft_owner' THEN
    RAISE EXCEPTION 'schema weft belongs to another role' USING ERRCODE = '42501',
      HINT = 'Use another database, or remove that schema';
  END IF;
  -- Index of parts of words, for searches. They work without it, but slower.
  IF NOT EXISTS (SELECT FROM pg_extension WHERE extname = 'pg_trgm') THEN
    BEGIN
      CREATE EXTENSION pg_trgm SCHEMA weft;
      REVOKE ALL ON ALL FUNCTIONS IN SCHEMA weft FROM PUBLIC;
    EXCEPTION WHEN insufficient_privilege OR undefined_file OR feature_not_supported THEN
      NULL;
    END;
  END IF;
END
$body$;
