CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE channel(name TEXT, unit TEXT, role TEXT, joint TEXT);
CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);
CREATE TABLE sample(t_ns INTEGER, "jpos.elbow" REAL, "truth.elbow" REAL);
INSERT INTO meta VALUES('format_version','1'),('robot','raven2'),('arm','gold');
INSERT INTO channel VALUES('jpos.elbow','deg','joint_estimate','elbow'),('truth.elbow','rad','joint_truth','elbow');
INSERT INTO event VALUES(5,'drop','a row');
INSERT INTO sample VALUES(1,0.5,NULL),(2,1,9e999),(4,-0.25,3);
