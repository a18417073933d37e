!> The group `statistics` of a results file: each statistic over all contacts together and of each contact, with
!> confidence intervals and values of the blocks, and histograms of the impacts.
module statistic_groups
   use measure_list, only: first_statistic, measure_table
   use number_text, only: to_text
   use quantity_groups, only: quantity_group_t
   use signal_peaks, only: peak_tolerance
   use statistic_types, only: run_statistics_t, statistic_count
   implicit none (type, external)
   private
   public :: write_statistics

contains

   !> Write the statistics of the impacts of a run, of all contacts together and of each alone.
   subroutine write_statistics(group, statistics, names)
      type(quantity_group_t), intent(in) :: group
      type(run_statistics_t), intent(in) :: statistics
      !> Names of the contacts, with blanks between them
      character(*), intent(in) :: names

      character(*), parameter :: along = 'surface', half_width_ending = '_half_width', block_ending = '_in_blocks'
      type(quantity_group_t) :: histogram
      integer :: blocks, i, k, contacts

      blocks = size(statistics%in_block, 2)
      contacts = size(statistics%has_finite_force)
      call group%put(along, [(k, k=0, contacts)], 'surface, in the order of &stop and &body, below before above; ' &
         //'0: all together', is_scale=.true.)
      call group%attribute('flag_values', [(k, k=0, contacts)], along)
      call group%attribute('flag_meanings', trim('all '//names), along)
      call group%attribute('all', 'of all surfaces together sums and means are of the sum of their forces, impacts ' &
         //'and times in contact; displacements of the stop point are of the stop from which the beam is released')
      call group%attribute('half_widths', '95 % by the t distribution over the blocks; nan: there is none')
      if (.not. all(statistics%has_finite_force)) call group%attribute('restitution', 'an impulse has neither a ' &
         //'maximum force nor a square: of a rigid stop RMS and maximum forces are nan, means over the time in ' &
         //'contact are without impulses, and the classes are of impulses')
      if (any(statistics%is_maximum_unfinished)) call group%attribute('unfinished', 'an impact lasts at the end; ' &
         //'mean and maximum impulses of its surface contain its force until then')
      call group%put('block', [(i, i=1, blocks)], 'block', is_scale=.true.)
      call group%put('block_start', statistics%edge(0:blocks - 1), 'time', 'begin of the block{, tau}', 'block')
      call group%put('block_end', statistics%edge(1:), 'time', 'its end{, tau}', 'block')
      do i = 1, statistic_count
         associate (measure => measure_table(first_statistic - 1 + i))
            call group%put(trim(measure%name), statistics%value(i, :), measure%quantity, measure%meaning, along)
            if (statistics%tolerance(i) > peak_tolerance) call group%attribute('tolerance', statistics%tolerance(i), &
               group%named(trim(measure%name)))
            call group%put(trim(measure%name)//half_width_ending, statistics%half_width(i, :), measure%quantity, &
               'half the width of its 95 % interval', along)
            call group%put(trim(measure%name)//block_ending, statistics%in_block(i, :, :), measure%quantity, &
               'the same block by block', 'block surface')
         end associate
      end do
      do k = 1, contacts
         histogram = group%subgroup('surface_'//to_text(k))
         if (statistics%has_finite_force(k)) then
            call histogram%put('class', statistics%class_edge(:, k), 'force', &
               'upper end of the class, maximum force of an impact', is_scale=.true.)
         else
            call histogram%put('class', statistics%class_edge(:, k), 'impulse', &
               'upper end of the class, impulse of an impact', is_scale=.true.)
         end if
         call histogram%put('impacts', statistics%class_count(:, k), 'impacts in it; in the first: from 0 on', 'class')
      end do
   end subroutine write_statistics

end module statistic_groups
