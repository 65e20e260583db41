// vtk_series.c: write a deforming surface as a series of VTK files that ParaView opens.
//
// This follows: Kitware, VTK XML file formats (PolyData .vtp, inline "binary" DataArrays: base64 of
// one UInt64 with the number of bytes and the bytes, in one go) and ParaView's .pvd collections.
#include "pliant/vtk_series.h"

#include "pliant/error.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define STEP_FORMAT "%s_%08lld.vtp"

enum { NAME_LIMIT = 48, TEXT_LIMIT = 1024 };  // bytes of a step's file name; of a file's fixed text

// What the names of a series begin with: index NAME.pvd, steps STEP_FORMAT, work folder NAME.tmp.
static const char *const names[PLIANT_VTK_CONTENT_COUNT] = {
    [PLIANT_VTK_SURFACE] = "pliant",
    [PLIANT_VTK_PARTICLES] = "pliant_particles",
    [PLIANT_VTK_OBSTACLES] = "pliant_obstacles",
};

static const char byte_order[] =
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    "LittleEndian";
#else
    "BigEndian";
#endif

struct pliant_vtk_series {
    char *folder, *work;  // "DIR", "DIR/pliant.tmp"
    char *path, *target;  // room for a path in work and one in folder
    size_t path_size;
    int made_folder;  // 1: the folder was not there before
    pliant_vtk_content content;
    int32_t vertex_count, face_count;
    const double *positions;  // borrowed
    const int32_t *instance;  // borrowed; NULL: not written
    int64_t step_count;
    FILE *index;  // DIR/pliant.tmp/pliant.pvd
    char *polys;  // the cells as XML, the same in every step
    size_t polys_size;
    float *values;  // [vertex_count][3], what is being encoded
    char *text;     // one whole step's file
    size_t text_capacity;
};

// ---- Base64 ----

static size_t base64_size(size_t bytes)
{
    return (bytes + 2) / 3 * 4;
}

// Encode `head` and then `bytes` as one run; returns the end of the text.
static char *encode(char *text, uint64_t head, const void *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned char group[3];
    const unsigned char *first = (const unsigned char *)&head, *rest = bytes;
    const size_t total = sizeof head + size;
    for (size_t at = 0; at < total; at += 3) {
        const size_t length = total - at < 3 ? total - at : 3;
        if (at >= sizeof head && length == 3) {
            memcpy(group, rest + (at - sizeof head), 3);
        } else {
            memset(group, 0, sizeof group);
            for (size_t k = 0; k < length; k++)
                group[k] = at + k < sizeof head ? first[at + k] : rest[at + k - sizeof head];
        }
        text[0] = digits[group[0] >> 2];
        text[1] = digits[(group[0] & 3) << 4 | group[1] >> 4];
        text[2] = length > 1 ? digits[(group[1] & 15) << 2 | group[2] >> 6] : '=';
        text[3] = length > 2 ? digits[group[2] & 63] : '=';
        text += 4;
    }
    return text;
}

static char *put(char *text, const char *line)
{
    const size_t length = strlen(line);
    memcpy(text, line, length);
    return text + length;
}

// A DataArray of 4-byte numbers.
static char *put_array(char *text, const char *opening, const void *data, size_t count)
{
    text = put(text, opening);
    text = encode(text, (uint64_t)count * 4, data, count * 4);
    return put(text, "</DataArray>\n");
}

// ---- Folders ----

static int is_name_of(const char *name, pliant_vtk_content content)
{
    const size_t length = strlen(names[content]);
    if (strncmp(name, names[content], length) != 0) return 0;
    if (strcmp(name + length, ".pvd") == 0) return 1;
    if (name[length] != '_') return 0;
    const char *digit = name + length + 1;
    const size_t count = strspn(digit, "0123456789");
    return count >= 8 && strcmp(digit + count, ".vtp") == 0;
}

static int is_own_name(const char *name)
{
    for (int c = 0; c < PLIANT_VTK_CONTENT_COUNT; c++)
        if (is_name_of(name, (pliant_vtk_content)c)) return 1;
    return 0;
}

static int is_vtk_name(const char *name)
{
    static const char *const endings[] = {".pvd", ".vtp", ".vtu", ".vtk",  ".vtm",
                                          ".vti", ".vts", ".vtr", ".pvtp", ".pvtu"};
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot && i < sizeof endings / sizeof *endings; i++)
        if (strcmp(dot, endings[i]) == 0) return 1;
    return 0;
}

// Refuse a folder that holds somebody else's series.
static pliant_status look_for_foreign(const char *folder, pliant_error *err)
{
    DIR *listing = opendir(folder);
    if (!listing) return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", folder, strerror(errno));
    pliant_status status = PLIANT_OK;
    for (struct dirent *entry; status == PLIANT_OK && (entry = readdir(listing));)
        if (is_vtk_name(entry->d_name) && !is_own_name(entry->d_name))
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                      "%s: holds another series (%.60s): expected an empty folder "
                                      "or a series of ours; --force writes beside it",
                                      folder, entry->d_name);
    closedir(listing);
    return status;
}

// Remove a series' files of a folder, a surface's with all that is ours; the rest stays. The work
// folders are not files.
static void remove_own(const char *folder, pliant_vtk_content content)
{
    for (int c = 0; c < PLIANT_VTK_CONTENT_COUNT; c++) {
        DIR *listing = opendir(folder);
        if (!listing) return;
        char index[NAME_LIMIT];
        snprintf(index, sizeof index, "%s.pvd", names[c]);
        const int is_meant = c == (int)content || content == PLIANT_VTK_SURFACE;
        if (is_meant) (void)unlinkat(dirfd(listing), index, 0);  // before what it lists
        for (struct dirent *entry; is_meant && (entry = readdir(listing));)
            if (is_name_of(entry->d_name, (pliant_vtk_content)c))
                (void)unlinkat(dirfd(listing), entry->d_name, 0);
        closedir(listing);
    }
}

// ---- Life ----

static void destroy(pliant_vtk_series *series)
{
    if (series->index) fclose(series->index);
    free(series->text);
    free(series->values);
    free(series->polys);
    free(series->target);
    free(series->path);
    free(series->work);
    free(series->folder);
    free(series);
}

void pliant_vtk_series_abandon(pliant_vtk_series *series)
{
    if (!series) return;
    remove_own(series->work, series->content);
    (void)rmdir(series->work);
    if (series->made_folder) (void)rmdir(series->folder);
    destroy(series);
}

static pliant_status name_paths(pliant_vtk_series *series, const char *folder, pliant_error *err)
{
    const size_t folder_size = strlen(folder) + 1;
    series->path_size = folder_size + 2 * NAME_LIMIT + 2;
    series->folder = malloc(folder_size);
    series->work = malloc(series->path_size);
    series->path = malloc(series->path_size);
    series->target = malloc(series->path_size);
    if (!series->folder || !series->work || !series->path || !series->target)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", folder);
    memcpy(series->folder, folder, folder_size);
    snprintf(series->work, series->path_size, "%s/%s.tmp", folder, names[series->content]);
    return PLIANT_OK;
}

static pliant_status allocate(pliant_vtk_series *series, const pliant_vtk_mesh *mesh,
                              pliant_error *err)
{
    const size_t n = (size_t)mesh->vertex_count, faces = (size_t)mesh->face_count;
    const size_t cells = faces > 0 ? base64_size(8 + 12 * faces) + base64_size(8 + 4 * faces)
                                   : 2 * base64_size(8 + 4 * n);
    free(series->polys);
    free(series->values);
    free(series->text);
    series->polys = malloc(cells + TEXT_LIMIT);
    series->values = malloc(12 * n + 1);
    // Four vector fields, the instances, the cells and the text around them.
    series->text_capacity =
        4 * base64_size(8 + 12 * n) + base64_size(8 + 4 * n) + cells + (size_t)4 * TEXT_LIMIT;
    series->text = malloc(series->text_capacity);
    if (!series->polys || !series->values || !series->text)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %d vertices",
                                series->folder, (int)mesh->vertex_count);
    return PLIANT_OK;
}

// The cells: triangles, or without any the points; and where each ends.
static pliant_status encode_cells(pliant_vtk_series *series, const pliant_vtk_mesh *mesh,
                                  pliant_error *err)
{
    const size_t corners = mesh->face_count > 0 ? 3 : 1;
    const size_t count = (size_t)(mesh->face_count > 0 ? mesh->face_count : mesh->vertex_count);
    int32_t *ends = malloc(4 * count + 1), *points = malloc(4 * count + 1);
    if (!ends || !points) {
        free(ends);
        free(points);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %zu cells",
                                series->folder, count);
    }
    for (size_t i = 0; i < count; i++) {
        ends[i] = (int32_t)(corners * (i + 1));
        points[i] = (int32_t)i;
    }
    char *text = put(series->polys, corners == 3 ? "<Polys>\n" : "<Verts>\n");
    text = put_array(text, "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"binary\">",
                     corners == 3 ? mesh->faces : points, corners * count);
    text = put_array(text, "<DataArray type=\"Int32\" Name=\"offsets\" format=\"binary\">", ends,
                     count);
    text = put(text, corners == 3 ? "</Polys>\n" : "</Verts>\n");
    series->polys_size = (size_t)(text - series->polys);
    free(points);
    free(ends);
    return PLIANT_OK;
}

pliant_status pliant_vtk_series_remesh(pliant_vtk_series *series, const pliant_vtk_mesh *mesh,
                                       pliant_error *err)
{
    if (mesh->vertex_count < 0 || mesh->face_count < 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: %d vertices and %d faces",
                                series->folder, (int)mesh->vertex_count, (int)mesh->face_count);
    series->vertex_count = mesh->vertex_count;
    series->face_count = mesh->face_count;
    series->positions = mesh->positions;
    series->instance = mesh->instance;
    const pliant_status status = allocate(series, mesh, err);
    return status < 0 ? status : encode_cells(series, mesh, err);
}

static pliant_status open_folder(pliant_vtk_series *series, const pliant_vtk_series_def *def,
                                 pliant_error *err)
{
    if (mkdir(def->folder, 0777) == 0) series->made_folder = 1;
    else if (errno != EEXIST)
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", def->folder, strerror(errno));
    else if (def->overwrite == PLIANT_VTK_OWN) {
        const pliant_status status = look_for_foreign(def->folder, err);
        if (status < 0) return status;
    }
    // What a killed run left in the work folder is ours to remove.
    if (mkdir(series->work, 0777) != 0) {
        if (errno != EEXIST)
            return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", series->work, strerror(errno));
        remove_own(series->work, series->content);
    }
    snprintf(series->path, series->path_size, "%s/%s.pvd", series->work, names[series->content]);
    series->index = fopen(series->path, "w");
    if (!series->index)
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", series->path, strerror(errno));
    fprintf(series->index,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
            "byte_order=\"%s\" header_type=\"UInt64\">\n<Collection>\n",
            byte_order);
    return PLIANT_OK;
}

pliant_status pliant_vtk_series_create(const pliant_vtk_series_def *def, pliant_vtk_series **series,
                                       pliant_error *err)
{
    pliant_vtk_series *s = calloc(1, sizeof *s);
    if (!s) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", def->folder);
    s->content = def->content;
    pliant_status status = name_paths(s, def->folder, err);
    if (status >= 0) status = pliant_vtk_series_remesh(s, &def->mesh, err);
    if (status < 0) {
        destroy(s);
        return status;
    }
    status = open_folder(s, def, err);
    if (status < 0) {
        // A foreign folder was not touched; one of ours loses at most the empty work folder.
        if (s->made_folder || s->index) {
            pliant_vtk_series_abandon(s);
        } else {
            (void)rmdir(s->work);
            destroy(s);
        }
        return status;
    }
    *series = s;
    return PLIANT_OK;
}

// ---- Steps ----

static void load(float *values, const pliant_vec3 *u, size_t count)
{
    for (size_t v = 0; v < count; v++) {
        values[3 * v] = u[v].x;
        values[3 * v + 1] = u[v].y;
        values[3 * v + 2] = u[v].z;
    }
}

// One step's file as text; returns its size.
static size_t compose(pliant_vtk_series *series, const pliant_vec3 *displacement,
                      const pliant_vec3 *traction, const pliant_vec3 *normals)
{
    const size_t n = (size_t)series->vertex_count;
    float *values = series->values;
    char *text = series->text;
    text += sprintf(text,
                    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
                    "byte_order=\"%s\" header_type=\"UInt64\">\n<PolyData>\n<Piece "
                    "NumberOfPoints=\"%zu\" NumberOfVerts=\"%zu\" NumberOfLines=\"0\" "
                    "NumberOfStrips=\"0\" NumberOfPolys=\"%zu\">\n",
                    byte_order, n, series->face_count > 0 ? 0 : n, (size_t)series->face_count);
    text = put(text, normals ? "<PointData Vectors=\"displacement\" Normals=\"normal\">\n"
                             : "<PointData Vectors=\"displacement\">\n");
    load(values, displacement, n);
    text = put_array(text,
                     "<DataArray type=\"Float32\" Name=\"displacement\" "
                     "NumberOfComponents=\"3\" format=\"binary\">",
                     values, 3 * n);
    if (traction) {
        load(values, traction, n);
        text = put_array(text,
                         "<DataArray type=\"Float32\" Name=\"traction\" "
                         "NumberOfComponents=\"3\" format=\"binary\">",
                         values, 3 * n);
    }
    if (normals) {
        load(values, normals, n);
        text = put_array(text,
                         "<DataArray type=\"Float32\" Name=\"normal\" "
                         "NumberOfComponents=\"3\" format=\"binary\">",
                         values, 3 * n);
    }
    if (series->instance)
        text = put_array(text, "<DataArray type=\"Int32\" Name=\"instance\" format=\"binary\">",
                         series->instance, n);
    text = put(text, "</PointData>\n<Points>\n");
    load(values, displacement, n);
    for (size_t i = 0; i < 3 * n; i++) values[i] = (float)(series->positions[i] + values[i]);
    text = put_array(text,
                     "<DataArray type=\"Float32\" Name=\"points\" NumberOfComponents=\"3\" "
                     "format=\"binary\">",
                     values, 3 * n);
    text = put(text, "</Points>\n");
    memcpy(text, series->polys, series->polys_size);
    text = put(text + series->polys_size, "</Piece>\n</PolyData>\n</VTKFile>\n");
    return (size_t)(text - series->text);
}

static pliant_status write_file(const char *path, const char *text, size_t size, pliant_error *err)
{
    const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    int failed = file < 0;
    while (!failed && size > 0) {
        const ssize_t written = write(file, text, size);
        if (written > 0) {
            text += written;
            size -= (size_t)written;
        } else if (written == 0 || errno != EINTR) {
            failed = 1;
        }
    }
    const int reason = errno;
    if (file >= 0 && close(file) != 0 && !failed)
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", path, strerror(errno));
    if (failed) return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", path, strerror(reason));
    return PLIANT_OK;
}

static void name_step(char *path, size_t size, const pliant_vtk_series *series, const char *folder,
                      int64_t number)
{
    snprintf(path, size, "%s/" STEP_FORMAT, folder, names[series->content], (long long)number);
}

pliant_status pliant_vtk_series_add(pliant_vtk_series *series, double time,
                                    const pliant_vec3 *displacement, const pliant_vec3 *traction,
                                    const pliant_vec3 *normals, pliant_error *err)
{
    const int64_t number = series->step_count + 1;
    name_step(series->path, series->path_size, series, series->work, number);
    const pliant_status status = write_file(series->path, series->text,
                                            compose(series, displacement, traction, normals), err);
    if (status < 0) return status;
    series->step_count = number;
    fprintf(series->index, "<DataSet timestep=\"%.12g\" part=\"0\" file=\"" STEP_FORMAT "\"/>\n",
            time, names[series->content], (long long)number);
    if (ferror(series->index))
        return pliant_error_set(err, PLIANT_ERR_IO, "%s/%s.pvd: %s", series->work,
                                names[series->content], strerror(errno));
    return PLIANT_OK;
}

pliant_status pliant_vtk_series_commit(pliant_vtk_series *series, pliant_error *err)
{
    fprintf(series->index, "</Collection>\n</VTKFile>\n");
    const int failed = ferror(series->index) | fclose(series->index);
    series->index = NULL;
    if (failed) {
        pliant_error_set(err, PLIANT_ERR_IO, "%s/%s.pvd: %s", series->work, names[series->content],
                         strerror(errno));
        pliant_vtk_series_abandon(series);
        return PLIANT_ERR_IO;
    }
    // The index goes first and comes last: it never lists files that are not there.
    remove_own(series->folder, series->content);
    pliant_status status = PLIANT_OK;
    for (int64_t i = 1; status >= 0 && i <= series->step_count + 1; i++) {
        if (i <= series->step_count) {
            name_step(series->path, series->path_size, series, series->work, i);
            name_step(series->target, series->path_size, series, series->folder, i);
        } else {
            snprintf(series->path, series->path_size, "%s/%s.pvd", series->work,
                     names[series->content]);
            snprintf(series->target, series->path_size, "%s/%s.pvd", series->folder,
                     names[series->content]);
        }
        if (rename(series->path, series->target) != 0)
            status =
                pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", series->target, strerror(errno));
    }
    if (status < 0) {
        remove_own(series->folder, series->content);
        pliant_vtk_series_abandon(series);
        return status;
    }
    (void)rmdir(series->work);
    destroy(series);
    return PLIANT_OK;
}
