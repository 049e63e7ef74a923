CREATE TABLE meta(key TEXT, value TEXT);
CREATE TABLE channel(name TEXT, unit TEXT, role TEXT, joint TEXT);
CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);
INSERT INTO meta VALUES('format_version','1');
INSERT INTO channel VALUES('x','1','feature','');
CREATE TABLE sample(t_ns INTEGER, x REAL AS (length(zeroblob(999999999))));
INSERT INTO sample(t_ns) VALUES(1),(2);
