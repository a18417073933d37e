!> Groups, datasets with unit and long name, dimension scales, attributes, and columns that are filled chunk by chunk,
!> in an HDF5 file made in memory or on the disk.
!>
!> Each call writes into the group on which it is made. There is no current group, and closing the file closes every
!> object open in it, so an early return cannot put data into a wrong group.
!>
!> Files are made in memory so that the disk sees a single write of finished bytes, whose failure has a reason, and HDF5
!> never meets a full disk. Object times are off so that the same content gives the same bytes.
module hdf5_writing
   use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_null_ptr, c_ptr
   use failures, only: failure_t
   use hdf5, only: h5dclose_f, h5dcreate_f, h5dget_space_f, h5dopen_f, h5dwrite_f, h5p_dataset_create_f, h5pclose_f, &
      h5pcreate_f, h5pset_obj_track_times_f, h5pset_virtual_f, h5s_select_set_f, h5sclose_f, h5screate_simple_f, &
      h5sselect_hyperslab_f, h5t_native_double, h5t_native_integer, hid_t, hsize_t, size_t
   use hdf5_file, only: hdf5_file_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: hdf5_group_t, hdf5_column_t

   !> Extent of a scalar dataset.
   integer(hsize_t), parameter :: no_extent(0) = 0_hsize_t

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
      !> Write a dataset: name, values, units, long name; the dimension scale of this group for its index, or whether
      !> the dataset is itself a dimension scale; one unit of the dataset in units of the scene, 0 if unknown
      generic :: add => add_real, add_reals, add_real_table, add_integer, add_integers, add_text, add_texts
      !> Make a list or a table that is filled later
      procedure :: column, rows
      !> Show a list of another group as a table
      procedure :: view
      !> Write an attribute of the group or of a dataset in the group: name, value, dataset
      generic :: attribute => text_attribute, real_attribute, reals_attribute, integers_attribute
      procedure, private :: add_real, add_reals, add_real_table, add_integer, add_integers, add_text, add_texts
      procedure, private :: text_attribute, real_attribute, reals_attribute, integers_attribute
      procedure, private :: label, open_object, close_object
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
      !> Root of the file; no object of the file can be used hereafter
      class(hdf5_group_t), intent(inout) :: self
      !> The finished file
      character(kind=c_char), allocatable, intent(out) :: bytes(:)
      !> First HDF5 call that failed
      type(failure_t), allocatable, intent(out) :: error

      call self%file%take_image(bytes)
      call self%finish_on_disk(error)
   end subroutine finish

   !> Close a file.
   subroutine finish_on_disk(self, error)
      !> Root of the file; no object of the file can be used hereafter
      class(hdf5_group_t), intent(inout) :: self
      !> First HDF5 call that failed
      type(failure_t), allocatable, intent(out) :: error

      call self%file%stop(error)
      deallocate (self%file)
   end subroutine finish_on_disk

   !> Make a subgroup.
   function group(self, name) result(made)
      class(hdf5_group_t), intent(in) :: self
      !> Name of the subgroup
      character(*), intent(in) :: name
      type(hdf5_group_t) :: made

      made%file => self%file
      made%id = self%file%make_group(self%id, name)
   end function group

   !> Write one number.
   subroutine add_real(self, name, value, units, long_name, in_scene_units)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), target, intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      real(wp), intent(in), optional :: in_scene_units

      call self%label(self%file%make_dataset(self%id, name, h5t_native_double, no_extent, c_loc(value)), units, &
         long_name, in_scene_units=in_scene_units)
   end subroutine add_real

   !> Write a list of numbers.
   subroutine add_reals(self, name, values, units, long_name, along, is_scale, in_scene_units)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale
      real(wp), intent(in), optional :: in_scene_units

      integer(hid_t) :: dataset

      dataset = self%file%make_dataset(self%id, name, h5t_native_double, [size(values, kind=hsize_t)], &
         address_of_reals(values), is_scale)
      call self%label(dataset, units, long_name, along, in_scene_units)
   end subroutine add_reals

   !> Write a table of numbers. Readers in C and Python see its dimensions reversed.
   subroutine add_real_table(self, name, values, units, long_name, along, in_scene_units)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> The dimension scales of this group for the first and the second index
      character(*), intent(in) :: along(2)
      real(wp), intent(in), optional :: in_scene_units

      integer(hid_t) :: dataset
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      dataset = self%file%make_dataset(self%id, name, h5t_native_double, shape(values, kind=hsize_t), address)
      call self%file%attach(dataset, self%id, [along(2), along(1)])
      call self%label(dataset, units, long_name, in_scene_units=in_scene_units)
   end subroutine add_real_table

   !> Write one integer.
   subroutine add_integer(self, name, value, units, long_name)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, target, intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name

      call self%label(self%file%make_dataset(self%id, name, h5t_native_integer, no_extent, c_loc(value)), units, &
         long_name)
   end subroutine add_integer

   !> Write a list of integers.
   subroutine add_integers(self, name, values, units, long_name, along, is_scale)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, contiguous, target, intent(in) :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale

      integer(hid_t) :: dataset

      dataset = self%file%make_dataset(self%id, name, h5t_native_integer, [size(values, kind=hsize_t)], &
         address_of_integers(values), is_scale)
      call self%label(dataset, units, long_name, along)
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

   !> Make a list whose values are written later.
   function column(self, name, length, units, long_name, is_whole, along, is_scale, in_scene_units) result(made)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Number of values
      integer, intent(in) :: length
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> Whether the values are integers
      logical, intent(in) :: is_whole
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale
      real(wp), intent(in), optional :: in_scene_units
      type(hdf5_column_t) :: made

      integer(hid_t) :: type

      type = h5t_native_double
      if (is_whole) type = h5t_native_integer
      made%file => self%file
      made%is_whole = is_whole
      made%id = self%file%make_dataset(self%id, name, type, [int(length, hsize_t)], c_null_ptr, is_scale)
      call self%file%describe(made%id, units, long_name, in_scene_units)
      if (present(along)) call self%file%attach(made%id, self%id, [along])
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

      integer(hid_t) :: dataset, list, properties, table, type
      integer :: status

      if (allocated(self%file%failed_call)) return
      type = h5t_native_double
      if (is_whole) type = h5t_native_integer
      call h5screate_simple_f(1, [product(int(extents, hsize_t))], list, status)
      ! HDF5's interface for Fortran reverses the order of the axes
      call h5screate_simple_f(size(extents), int(extents(size(extents):1:-1), hsize_t), table, status)
      call h5pcreate_f(h5p_dataset_create_f, properties, status)
      call h5pset_obj_track_times_f(properties, .false., status)
      call h5pset_virtual_f(properties, table, '.', source//'/'//name, list, status)
      call self%file%check(status, 'a view')
      call h5dcreate_f(self%id, name, type, table, dataset, status, dcpl_id=properties)
      call self%file%check(status, name)
      call self%file%describe(dataset, units, long_name, in_scene_units)
      call self%file%attach(dataset, self%id, scales)
      call h5dclose_f(dataset, status)
      call h5pclose_f(properties, status)
      call h5sclose_f(list, status)
      call h5sclose_f(table, status)
   end subroutine view

   !> Make a table whose rows are written later.
   function rows(self, name, extents, units, long_name, along, in_scene_units) result(made)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Number of values in a row, and number of rows
      integer, intent(in) :: extents(2)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> Dimension scale of the rows
      character(*), intent(in) :: along
      real(wp), intent(in), optional :: in_scene_units
      type(hdf5_column_t) :: made

      made%file => self%file
      made%width = extents(1)
      made%id = self%file%make_dataset(self%id, name, h5t_native_double, int(extents, hsize_t), c_null_ptr)
      call self%file%describe(made%id, units, long_name, in_scene_units)
      call self%file%attach(made%id, self%id, [along], rank=2)
   end function rows

   !> Write values of a list, or rows of a table, from a given index on.
   subroutine put(self, first, values)
      class(hdf5_column_t), intent(in) :: self
      !> Index of the first value, or of the first row, from 1
      integer, intent(in) :: first
      !> Values of the list (integral values if the list is of integers), or complete rows of the table
      real(wp), contiguous, target, intent(in) :: values(:)

      integer(hid_t) :: space, memory
      integer, allocatable, target :: integers(:)
      integer :: status

      if (allocated(self%file%failed_call) .or. size(values) == 0) return
      call h5screate_simple_f(1, [size(values, kind=hsize_t)], memory, status)
      call h5dget_space_f(self%id, space, status)
      if (self%width > 0) then
         call h5sselect_hyperslab_f(space, h5s_select_set_f, [0_hsize_t, int(first - 1, hsize_t)], &
            [int(self%width, hsize_t), size(values, kind=hsize_t)/int(self%width, hsize_t)], status)
      else
         call h5sselect_hyperslab_f(space, h5s_select_set_f, [int(first - 1, hsize_t)], [size(values, kind=hsize_t)], &
            status)
      end if
      call self%file%check(status, 'a place in a column')
      if (self%is_whole) then
         allocate (integers(size(values)))
         integers(:) = nint(values)
         call h5dwrite_f(self%id, h5t_native_integer, c_loc(integers), status, memory, space)
      else
         call h5dwrite_f(self%id, h5t_native_double, c_loc(values), status, memory, space)
      end if
      call self%file%check(status, 'a column')
      call h5sclose_f(space, status)
      call h5sclose_f(memory, status)
   end subroutine put

   subroutine text_attribute(self, name, text, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: text
      !> Dataset in the group; absent: the attribute belongs to the group itself
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%file%write_text(object, name, text)
      call self%close_object(object, dataset)
   end subroutine text_attribute

   subroutine real_attribute(self, name, value, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), target, intent(in) :: value
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%file%write_attribute(object, name, h5t_native_double, c_loc(value))
      call self%close_object(object, dataset)
   end subroutine real_attribute

   subroutine reals_attribute(self, name, values, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(:)
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%file%write_attribute(object, name, h5t_native_double, address_of_reals(values), &
         size(values, kind=hsize_t))
      call self%close_object(object, dataset)
   end subroutine reals_attribute

   subroutine integers_attribute(self, name, values, dataset)
      class(hdf5_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, contiguous, target, intent(in) :: values(:)
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%file%write_attribute(object, name, h5t_native_integer, address_of_integers(values), &
         size(values, kind=hsize_t))
      call self%close_object(object, dataset)
   end subroutine integers_attribute

   !> Write units and long name of a new dataset, attach its dimension scale, and close the dataset.
   subroutine label(self, dataset, units, long_name, along, in_scene_units)
      class(hdf5_group_t), intent(in) :: self
      integer(hid_t), intent(in) :: dataset
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      character(*), intent(in), optional :: along
      real(wp), intent(in), optional :: in_scene_units

      integer :: status

      call self%file%describe(dataset, units, long_name, in_scene_units)
      if (present(along)) then
         if (along /= '') call self%file%attach(dataset, self%id, [along])
      end if
      if (dataset >= 0_hid_t) call h5dclose_f(dataset, status)
   end subroutine label

   !> Open the group or a dataset in the group for attributes.
   subroutine open_object(self, object, dataset)
      class(hdf5_group_t), intent(in) :: self
      integer(hid_t), intent(out) :: object
      character(*), intent(in), optional :: dataset

      integer :: status

      object = self%id
      if (allocated(self%file%failed_call) .or. .not. present(dataset)) return
      call h5dopen_f(self%id, dataset, object, status)
      call self%file%check(status, dataset)
   end subroutine open_object

   !> Close the object that `open_object` opened.
   subroutine close_object(self, object, dataset)
      class(hdf5_group_t), intent(in) :: self
      integer(hid_t), intent(in) :: object
      character(*), intent(in), optional :: dataset

      integer :: status

      if (allocated(self%file%failed_call) .or. .not. present(dataset)) return
      call h5dclose_f(object, status)
   end subroutine close_object

   !> Address of an array, null if the array is empty.
   function address_of_reals(values) result(address)
      real(wp), contiguous, target, intent(in) :: values(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
   end function address_of_reals

   function address_of_integers(values) result(address)
      integer, contiguous, target, intent(in) :: values(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
   end function address_of_integers

end module hdf5_writing
