!> Groups, datasets with unit and long name, dimension scales, attributes, and columns that are filled chunk by chunk,
!> in an HDF5 file made in memory or on the disk.
!>
!> Each call writes into the group on which it is made. There is no current group, and closing the file closes every
!> object open in it, so an early return cannot put data into a wrong group.
!>
!> Files are made in memory so that the disk sees a single write of finished bytes, whose failure has a reason, and HDF5
!> never meets a full disk. Object times are off so that the same content gives the same bytes.
module hdf5_writing
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc, c_null_char, c_null_ptr, c_ptr
   use failures, only: failure_t
   use hdf5, only: h5dclose_f, h5dcreate_f, h5dget_space_f, h5dopen_f, h5dwrite_f, h5p_dataset_create_f, h5pclose_f, &
      h5pcreate_f, h5pset_obj_track_times_f, h5pset_virtual_f, h5s_select_set_f, h5sclose_f, h5screate_simple_f, &
      h5sselect_hyperslab_f, h5t_native_double, h5t_native_integer, hid_t, hsize_t, size_t
   use hdf5_file, only: hdf5_file_t, no_extent
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: hdf5_group_t, hdf5_column_t

   !> Maximum length of the name of a dimension scale.
   integer, parameter :: max_scale_name_length = 64

   !> A group of a file. `begin` and `begin_on_disk` make the root of a file; `finish` and `finish_on_disk` close the
   !> file with all its groups.
   type :: hdf5_group_t
      private
      type(hdf5_file_t), pointer :: file => null()
      integer(hid_t) :: id = -1_hid_t
   contains
      procedure :: begin, begin_on_disk, finish, finish_on_disk
      !> Make a subgroup
      procedure :: group
      !> Write a dataset: name, values (a number, a list or a table), units, long name; the dimension scales of this
      !> group for its indices, separated by a blank, or whether the dataset is itself a dimension scale; one unit of
      !> the dataset in units of the scene, 0 if unknown; a factor for real values. Readers in C and Python see the
      !> dimensions of a table reversed
      generic :: add => add_reals, add_integers, add_text, add_texts
      !> Make a list or a table that is filled later
      procedure :: column
      !> Show a list of another group as a table
      procedure :: view
      !> Write an attribute of the group or of a dataset in the group: name, value, dataset
      generic :: attribute => text_attribute, reals_attribute, integers_attribute
      procedure, private :: add_reals, add_integers, add_text, add_texts
      procedure, private :: text_attribute, reals_attribute, integers_attribute
      procedure, private :: label, write_attribute
   end type hdf5_group_t

   !> A list or table in a file that is filled chunk by chunk. Closing the file closes the list.
   type :: hdf5_column_t
      private
      type(hdf5_file_t), pointer :: file => null()
      integer(hid_t) :: id = -1_hid_t
      !> Whether the values are integers
      logical :: is_whole = .false.
      !> Number of values in a row of a table; 0: the dataset is a list
      integer :: width = 0
   contains
      procedure :: put
   end type hdf5_column_t

contains

   !> Start an empty file in memory.
   subroutine begin(self, expected_size)
      !> Root of the file
      class(hdf5_group_t), intent(out) :: self
      !> Estimated size of the file in bytes
      integer(size_t), intent(in) :: expected_size

      allocate (self%file)
      call self%file%start('results', expected_size)
      self%id = self%file%id
   end subroutine begin

   !> Start an empty file on the disk, for results that may exceed the memory.
   subroutine begin_on_disk(self, path)
      !> Root of the file
      class(hdf5_group_t), intent(out) :: self
      !> Path of the file; an existing file is replaced
      character(*), intent(in) :: path

      allocate (self%file)
      call self%file%start(path)
      self%id = self%file%id
   end subroutine begin_on_disk

   !> Close a file in memory and return its bytes.
   subroutine finish(self, bytes, error)
      !> Root of the file; no object of the file can be used afterwards
      class(hdf5_group_t), intent(inout) :: self
      !> The finished file
      character(:), allocatable, intent(out) :: bytes
      !> First HDF5 call that failed
      type(failure_t), allocatable, intent(out) :: error

      call self%file%take_image(bytes)
      call self%finish_on_disk(error)
   end subroutine finish

   !> Close a file.
   subroutine finish_on_disk(self, error)
      !> Root of the file; no object of the file can be used afterwards
      class(hdf5_group_t), intent(inout) :: self
      !> First HDF5 call that failed
      type(failure_t), allocatable, intent(out) :: error

      call self%file%stop(error)
      deallocate (self%file)
   end subroutine finish_on_disk

   !> Make a subgroup.
   type(hdf5_group_t) function group(self, name) result(made)
      class(hdf5_group_t), intent(in) :: self
      !> Name of the subgroup
      character(*), intent(in) :: name

      made%file => self%file
      made%id = self%file%make_group(self%id, name)
   end function group

   !> Write numbers.
   subroutine add_reals(self, name, values, units, long_name, along, is_scale, in_scene_units, factor)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(..)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale
      real(wp), intent(in), optional :: in_scene_units
      !> Factor by which the values are multiplied; absent: 1
      real(wp), intent(in), optional :: factor

      real(wp), pointer :: list(:)
      real(wp), allocatable, target :: scaled(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      if (size(values) > 0 .and. present(factor)) then
         call c_f_pointer(address, list, [size(values)])
         allocate (scaled, source=factor*list)
         address = c_loc(scaled)
      end if
      call self%label(self%file%make_dataset(self%id, name, h5t_native_double, shape(values, kind=hsize_t), address, &
         is_scale), units, long_name, along, in_scene_units)
   end subroutine add_reals

   !> Write integers.
   subroutine add_integers(self, name, values, units, long_name, along, is_scale)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, contiguous, target, intent(in) :: values(..)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale

      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%label(self%file%make_dataset(self%id, name, h5t_native_integer, shape(values, kind=hsize_t), address, &
         is_scale), units, long_name, along)
   end subroutine add_integers

   !> Write one text.
   subroutine add_text(self, name, text, units, long_name)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: text
      !> 'none', because a text has no unit
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name

      character(:), allocatable, target :: terminated
      type(c_ptr), target :: address

      terminated = text//c_null_char
      address = c_loc(terminated)
      call self%label(self%file%make_dataset(self%id, name, self%file%text_type, no_extent, c_loc(address)), units, &
         long_name)
   end subroutine add_text

   !> Write a list of texts without their trailing blanks.
   subroutine add_texts(self, name, texts, units, long_name, along)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: texts(:)
      !> 'none', because a text has no unit
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in) :: along

      character(len(texts) + 1), target :: terminated(size(texts))
      integer(hid_t) :: dataset
      integer :: i
      type(c_ptr), target :: addresses(size(texts))
      type(c_ptr) :: address

      do i = 1, size(texts)
         terminated(i) = trim(texts(i))//c_null_char
         addresses(i) = c_loc(terminated(i))
      end do
      address = c_null_ptr
      if (size(texts) > 0) address = c_loc(addresses)
      dataset = self%file%make_dataset(self%id, name, self%file%text_type, [size(texts, kind=hsize_t)], address)
      call self%label(dataset, units, long_name, along)
   end subroutine add_texts

   !> Make a list whose values, or a table whose rows, are written later.
   function column(self, name, extents, units, long_name, is_whole, along, is_scale, in_scene_units) result(made)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Number of values of a list; number of values in a row, and of rows, of a table
      integer, intent(in) :: extents(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> Whether the values are integers
      logical, intent(in) :: is_whole
      !> Dimension scale of the values of a list, or of the rows of a table
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale
      real(wp), intent(in), optional :: in_scene_units
      type(hdf5_column_t) :: made

      integer(hid_t) :: type_id

      type_id = h5t_native_double
      if (is_whole) type_id = h5t_native_integer
      made%file => self%file
      made%is_whole = is_whole
      if (size(extents) > 1) made%width = extents(1)
      made%id = self%file%make_dataset(self%id, name, type_id, int(extents, hsize_t), c_null_ptr, is_scale)
      call self%file%describe(made%id, units, long_name, in_scene_units)
      if (present(along)) call self%file%attach(made%id, self%id, [along], rank=size(extents))
   end function column

   !> Show a list of another group, whose values are stored there alone, as a table whose axes are dimension scales of
   !> this group. The last axis varies fastest.
   subroutine view(self, name, source, extents, scales, units, long_name, is_whole, in_scene_units)
      class(hdf5_group_t), intent(in) :: self
      !> Name of the list, and of the table
      character(*), intent(in) :: name
      !> Path of the group of the list
      character(*), intent(in) :: source
      !> Number of values along each axis
      integer, intent(in) :: extents(:)
      !> Names of the dimension scales of the axes
      character(*), intent(in) :: scales(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> Whether the values are integers
      logical, intent(in) :: is_whole
      real(wp), intent(in) :: in_scene_units

      integer(hid_t) :: dataset, list, properties, table, type_id
      integer :: status

      if (allocated(self%file%failed_call)) return
      type_id = h5t_native_double
      if (is_whole) type_id = h5t_native_integer
      call h5screate_simple_f(1, [product(int(extents, hsize_t))], list, status)
      ! HDF5's interface for Fortran reverses the order of the axes
      call h5screate_simple_f(size(extents), int(extents(size(extents):1:-1), hsize_t), table, status)
      call h5pcreate_f(h5p_dataset_create_f, properties, status)
      call h5pset_obj_track_times_f(properties, .false., status)
      call h5pset_virtual_f(properties, table, '.', source//'/'//name, list, status)
      call self%file%check(status, 'a view')
      call h5dcreate_f(self%id, name, type_id, table, dataset, status, dcpl_id=properties)
      call self%file%check(status, name)
      call self%file%describe(dataset, units, long_name, in_scene_units)
      call self%file%attach(dataset, self%id, scales)
      call h5dclose_f(dataset, status)
      call h5pclose_f(properties, status)
      call h5sclose_f(list, status)
      call h5sclose_f(table, status)
   end subroutine view

   !> Write values of a list, or rows of a table, from a given index on.
   subroutine put(self, first, values)
      class(hdf5_column_t), intent(in) :: self
      !> Index of the first value, or of the first row, from 1
      integer, intent(in) :: first
      !> Values of the list (integral values if the list is of integers), or complete rows of the table
      real(wp), contiguous, target, intent(in) :: values(:)

      integer(hid_t) :: space_id, memory
      integer, allocatable, target :: integers(:)
      integer :: status

      if (allocated(self%file%failed_call) .or. size(values) == 0) return
      call h5screate_simple_f(1, [size(values, kind=hsize_t)], memory, status)
      call h5dget_space_f(self%id, space_id, status)
      if (self%width > 0) then
         call h5sselect_hyperslab_f(space_id, h5s_select_set_f, [0_hsize_t, int(first - 1, hsize_t)], &
            [int(self%width, hsize_t), size(values, kind=hsize_t)/int(self%width, hsize_t)], status)
      else
         call h5sselect_hyperslab_f(space_id, h5s_select_set_f, [int(first - 1, hsize_t)], &
            [size(values, kind=hsize_t)], status)
      end if
      call self%file%check(status, 'a place in a column')
      if (self%is_whole) then
         allocate (integers, source=nint(values))
         call h5dwrite_f(self%id, h5t_native_integer, c_loc(integers), status, memory, space_id)
      else
         call h5dwrite_f(self%id, h5t_native_double, c_loc(values), status, memory, space_id)
      end if
      call self%file%check(status, 'a column')
      call h5sclose_f(space_id, status)
      call h5sclose_f(memory, status)
   end subroutine put

   subroutine text_attribute(self, name, text, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: text
      !> Dataset in the group; absent: the attribute belongs to the group itself
      character(*), intent(in), optional :: dataset

      character(len(text) + 1), target :: terminated
      type(c_ptr), target :: address

      terminated = text//c_null_char
      address = c_loc(terminated)
      call self%write_attribute(name, self%file%text_type, no_extent, c_loc(address), dataset)
   end subroutine text_attribute

   subroutine reals_attribute(self, name, values, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(..)
      character(*), intent(in), optional :: dataset

      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%write_attribute(name, h5t_native_double, shape(values, kind=hsize_t), address, dataset)
   end subroutine reals_attribute

   subroutine integers_attribute(self, name, values, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, contiguous, target, intent(in) :: values(..)
      character(*), intent(in), optional :: dataset

      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%write_attribute(name, h5t_native_integer, shape(values, kind=hsize_t), address, dataset)
   end subroutine integers_attribute

   !> Write units and long name of a new dataset, attach its dimension scales, and close the dataset.
   subroutine label(self, dataset, units, long_name, along, in_scene_units)
      class(hdf5_group_t), intent(in) :: self
      integer(hid_t), intent(in) :: dataset
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in), optional :: along
      real(wp), intent(in), optional :: in_scene_units

      character(max_scale_name_length) :: scales(2)
      integer :: blank, status

      call self%file%describe(dataset, units, long_name, in_scene_units)
      if (present(along)) then
         blank = index(trim(along), ' ')
         scales(1) = along(blank + 1:)
         scales(2) = along(:blank - 1)
         if (along /= '') call self%file%attach(dataset, self%id, scales(:merge(2, 1, blank > 0)))
      end if
      if (dataset >= 0_hid_t) call h5dclose_f(dataset, status)
   end subroutine label

   !> Write an attribute of the group or of a dataset in the group.
   subroutine write_attribute(self, name, type_id, extent, address, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer(hid_t), intent(in) :: type_id
      integer(hsize_t), intent(in) :: extent(:)
      !> Address of the values
      type(c_ptr), intent(in) :: address
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object
      integer :: status

      if (allocated(self%file%failed_call)) return
      object = self%id
      if (present(dataset)) call h5dopen_f(self%id, dataset, object, status)
      if (present(dataset)) call self%file%check(status, dataset)
      call self%file%write_attribute(object, name, type_id, extent, address)
      if (present(dataset)) call h5dclose_f(object, status)
   end subroutine write_attribute

end module hdf5_writing
