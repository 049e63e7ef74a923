CREATE TABLE meta(key TEXT, value TEXT);
CREATE VIEW channel AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) SELECT i AS rowid, i AS name, 1 AS unit, 1 AS role, 1 AS joint FROM n; CREATE TABLE unused(name TEXT, unit TEXT, role TEXT, joint TEXT);
CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);
INSERT INTO meta VALUES('format_version','1');
CREATE TABLE sample(t_ns INTEGER);
