!> The names of &frequency_response.
module frequency_response_names
   use kinds, only: wp
   use name_table, only: table_t
   use name_types, only: group_t, name_t
   use scene_types, only: scene_t
   use value_rules, only: physical_range, range_t
   implicit none (type, external)
   private
   public :: list_frequency_response

contains

   subroutine list_frequency_response(table, scene)
      class(table_t), intent(inout) :: table
      type(scene_t), intent(inout) :: scene

      call table%open(group_t('frequency_response'), scene%wants_frequency_response)
      if (.not. table%is_open) return
      associate (response => scene%frequency_response)
         call table%bind(response%range, name_t('frequency_ratio_range', 'least and greatest frequency of the ' &
            //'harmonic loads, over that of omega1', range_t(0.0_wp, 1.0e6_wp, excludes_least=.true.), &
            default='none: give one'))
         call table%keep(name_t('frequency_range', 'the same in periods over time', physical_range, &
            instead_of='frequency_ratio_range', quantity='frequency'), is_list=.true.)
         call table%bind(response%points, name_t('points', 'frequencies in it', range_t(2, 1000000)))
         call table%bind(response%is_logarithmic, name_t('logarithmic', 'divide it evenly in the logarithm'))
      end associate
   end subroutine list_frequency_response

end module frequency_response_names
