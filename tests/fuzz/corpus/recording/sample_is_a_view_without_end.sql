CREATE TABLE meta(key TEXT, value TEXT);
CREATE TABLE channel(name TEXT, unit TEXT, role TEXT, joint TEXT);
CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);
INSERT INTO meta VALUES('format_version','1');
INSERT INTO channel VALUES('x','1','feature','');
CREATE VIEW sample AS WITH RECURSIVE n(rowid, t_ns, x) AS (SELECT 1,1,1 UNION ALL SELECT rowid+1,t_ns,x FROM n) SELECT * FROM n;
