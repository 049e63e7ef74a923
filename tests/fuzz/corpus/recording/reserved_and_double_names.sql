CREATE TABLE meta(key TEXT, value TEXT);
CREATE TABLE channel(name TEXT, unit TEXT, role TEXT, joint TEXT);
CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);
INSERT INTO meta VALUES('format_version','1');
INSERT INTO channel VALUES('rowid','1','feature',''),('X','1','feature',''),('x','1','feature','');
CREATE TABLE sample(t_ns INTEGER, x REAL);
INSERT INTO sample VALUES(1,1);
